#include "costate/formulation/own_courses.h"

#include <cmath>

#include "costate/assembly/own_state.h"

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

}  // namespace

void add_own_course(const OwnValue& value, Assembly& assembly, const StateView& start, Course& course) {
  OwnState first = whole_state(start, assembly, 0), beside = whole_state(start, assembly, kBesideStart);
  if (!asks_for_time(value, first.view(), assembly) && !asks_for_time(value, beside.view(), assembly)) return;
  course.search([&](double t) {
    const auto at = [&](OwnState& s) {
      s.t = t;
      const double f = value(s.view(), assembly);
      return std::isfinite(f) ? f : 0;
    };
    return at(first) + 0.7 * at(beside);
  });
}

}  // namespace costate
