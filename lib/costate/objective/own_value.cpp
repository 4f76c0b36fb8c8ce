#include "costate/objective/own_value.h"

#include <cfenv>
#include <cmath>
#include <limits>
#include <memory>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/base/library_class.h"
#include "costate/element/course.h"
#include "costate/objective/cost_check.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {

double mixed(const std::vector<double>& values) {
  double sum = 0, weight = 1;
  for (const double value : values) {
    sum += weight * value;
    weight = 0.3 + 0.61803398875 * weight;
  }
  return sum;
}

/// `evaluate` throws Error where it says nothing.
template <class Evaluate>
double known(const Evaluate& evaluate) {
  try {
    return evaluate();
  } catch (const Error&) {
    return std::numeric_limits<double>::quiet_NaN();
  }
}

struct Buffers {
  GatheredState own;
  std::vector<double> values;
};

}  // namespace

bool is_own(const Element& element) {
  return !is_wholly_of_library(typeid(element)) && !dynamic_cast<const CourseElement*>(&element);
}

bool is_own(const CostTerm& term) { return is_of_user(ungated(term)); }

OwnValue own_value(const Mechanism& mechanism, const Element& element) {
  const auto buffers = std::make_shared<Buffers>();
  if (const auto* c = dynamic_cast<const Constraint*>(&element)) {
    if (!c->rheonomic()) return {};
    return [c, buffers](const StateView& s, Assembly& assembly) {
      return known([&] {
        const LocalState local = buffers->own.of(*c, s, assembly.numbers());
        const auto rows = static_cast<std::size_t>(c->rows());
        buffers->values.assign(2 * rows, 0);
        c->calc_phi_t(local, buffers->values.data());
        c->calc_bias(local, buffers->values.data() + rows);
        return mixed(buffers->values);
      });
    };
  }
  const auto* force = dynamic_cast<const Force*>(&element);
  if (!force) return {};
  int first = 0;
  for (std::size_t f = 0; f < mechanism.forces().size(); ++f)
    if (mechanism.forces()[f].get() == force) first = mechanism.state_offsets()[f];
  return [force, first, buffers](const StateView& s, Assembly& assembly) {
    return known([&] {
      LocalState local = buffers->own.of(*force, s, assembly.numbers());
      local.z = s.z ? s.z + first : nullptr;
      const std::size_t count = force->coordinates().size();
      buffers->values.assign(count + static_cast<std::size_t>(force->states()), 0);
      force->calc_force(local, buffers->values.data(), buffers->values.data() + count);
      return mixed(buffers->values);
    });
  };
}

OwnValue own_value(const CostTerm& term) {
  return [own = &ungated(term)](const StateView& s, Assembly& assembly) {
    return known([&] { return own->value(s, assembly); });
  };
}

bool asks_for_time(const OwnValue& value, StateView s, Assembly& assembly) {
  std::fenv_t flags;
  std::fegetenv(&flags);
  std::feclearexcept(FE_INVALID);
  s.t = std::numeric_limits<double>::quiet_NaN();
  const bool is_none = !std::isfinite(value(s, assembly)), compared = std::fetestexcept(FE_INVALID) != 0;
  std::fesetenv(&flags);
  return is_none || compared;
}

}  // namespace costate
