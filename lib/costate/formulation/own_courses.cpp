#include "costate/formulation/own_courses.h"

#include <cfenv>
#include <cmath>
#include <limits>

#include "costate/assembly/gathered_state.h"
#include "costate/assembly/own_state.h"
#include "costate/base/error.h"
#include "costate/base/library_class.h"
#include "costate/objective/cost_check.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {

/// How far beside the start, of a coordinate and 1, and of a velocity and 1: what is held at zero by a factor that is
/// zero at the start acts there.
constexpr double kBesideStart = 0.1;

/// A state with all that an element or a cost may ask for.
OwnState whole_state(const StateView& start, const Assembly& assembly, double beside) {
  OwnState s;
  s.take(start, assembly);
  s.q.resize(static_cast<std::size_t>(assembly.n()), 0);
  s.v.resize(s.q.size(), 0);
  s.a.assign(s.q.size(), 0);
  s.lambda.assign(static_cast<std::size_t>(assembly.m()), 0);
  s.z.resize(static_cast<std::size_t>(assembly.nz()), 0);
  double part = beside;
  for (auto* entries : {&s.q, &s.v, &s.z})
    for (double& x : *entries) {
      x += part * (1 + std::abs(x));
      part = -part * 0.9;
    }
  return s;
}

/// `evaluate` gives what something is made of at a state.
template <class Evaluate>
class OfTime {
 public:
  OfTime(const Assembly& assembly, const StateView& start, Evaluate evaluate)
      : states_{whole_state(start, assembly, 0), whole_state(start, assembly, kBesideStart)},
        evaluate_(std::move(evaluate)) {}

  /// No number in the place of the time comes out as none, or is compared with one, which says so by FE_INVALID.
  bool asks_for_time() {
    std::fenv_t flags;
    std::fegetenv(&flags);
    std::feclearexcept(FE_INVALID);
    bool asks = false;
    for (OwnState& s : states_) try {
        s.t = std::numeric_limits<double>::quiet_NaN();
        for (const double value : evaluate_(s.view())) asks = asks || !std::isfinite(value);
      } catch (const Error&) {
        asks = true;
      }
    asks = asks || std::fetestexcept(FE_INVALID) != 0;
    std::fesetenv(&flags);
    return asks;
  }

  /// Different parts of each entry, at either state, so that nothing is lost in the sum; nothing where a formula says
  /// nothing.
  double at(double t) {
    double sum = 0, weight = 1;
    for (OwnState& s : states_) try {
        s.t = t;
        for (const double value : evaluate_(s.view())) {
          if (std::isfinite(value)) sum += weight * value;
          weight = 0.3 + 0.61803398875 * weight;
        }
      } catch (const Error&) {
      }
    return sum;
  }

 private:
  OwnState states_[2];
  Evaluate evaluate_;
};

template <class Evaluate>
void search_along_time(const Assembly& assembly, const StateView& start, Course& course, Evaluate evaluate) {
  OfTime<Evaluate> of(assembly, start, std::move(evaluate));
  if (of.asks_for_time()) course.search([&](double t) { return of.at(t); });
}

}  // namespace

bool may_have_own_course(const Element& element) {
  if (is_wholly_of_library(typeid(element))) return false;
  if (const auto* c = dynamic_cast<const Constraint*>(&element)) return c->rheonomic();
  return dynamic_cast<const Force*>(&element) != nullptr;
}

bool may_have_own_course(const CostTerm& term) { return is_of_user(ungated(term)); }

void add_own_course(const Element& element, const Assembly& assembly, const StateView& start, Course& course) {
  const Mechanism& m = assembly.mechanism();
  int first_state = 0;
  for (std::size_t f = 0; f < m.forces().size(); ++f)
    if (m.forces()[f].get() == &element) first_state = m.state_offsets()[f];
  GatheredState own;
  std::vector<double> values;
  search_along_time(assembly, start, course, [&](const StateView& s) -> const std::vector<double>& {
    LocalState local = own.of(element, s, assembly.numbers());
    if (const auto* c = dynamic_cast<const Constraint*>(&element)) {
      const auto rows = static_cast<std::size_t>(c->rows());
      values.assign(2 * rows, 0);
      c->calc_phi_t(local, values.data());
      c->calc_bias(local, values.data() + rows);
      return values;
    }
    const auto& force = dynamic_cast<const Force&>(element);
    local.z = s.z ? s.z + first_state : nullptr;
    const std::size_t count = force.coordinates().size();
    values.assign(count + static_cast<std::size_t>(force.states()), 0);
    force.calc_force(local, values.data(), values.data() + count);
    return values;
  });
}

void add_own_course(const CostTerm& term, const Assembly& assembly, const StateView& start, Course& course) {
  const CostTerm& own = ungated(term);
  Assembly of_cost(assembly.mechanism_ptr(), assembly.parameters());
  of_cost.set_parameters(assembly.rho().data());
  search_along_time(assembly, start, course,
                    [&](const StateView& s) { return std::vector<double>{own.value(s, of_cost)}; });
}

}  // namespace costate
