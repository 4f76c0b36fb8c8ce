#include "costate/adjoint/gradient_rate.h"

#include "costate/level/acceleration_rates.h"

namespace costate {

namespace {

/// rates: a' and lambda', or null where no term depends on accelerations or multipliers.
void calc_rate(const Objective& objective, Assembly& assembly, const StateView& s, const double* rates,
               ScalarGradient& out) {
  const std::vector<double> no_change(assembly.numbers().size(), 0.0);
  Variation d;
  d.t = 1;
  d.q = s.v;
  d.v = s.a;
  if (rates) {
    d.a = rates;
    d.lambda = rates + assembly.n();
  }
  d.z = assembly.zdot.data();
  d.numbers = no_change.data();
  out.set_zero();
  objective.add_running_gradient_change(s, assembly, d, out);
}

}  // namespace

void calc_running_gradient_rate(const Objective& objective, Assembly& assembly, const StateView& s,
                                ScalarGradient& out) {
  calc_rate(objective, assembly, s, nullptr, out);
}

void calc_running_gradient_rate(const Objective& objective, Assembly& assembly, AccelerationLevel& level,
                                ScalarGradient& out) {
  const StateView s = level.state();
  if (!objective.running_needs_accelerations()) return calc_running_gradient_rate(objective, assembly, s, out);
  calc_rate(objective, assembly, s, acceleration_rates(assembly, level).data(), out);
}

}  // namespace costate
