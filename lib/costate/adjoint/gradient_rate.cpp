#include "costate/adjoint/gradient_rate.h"

#include "costate/assembly/path_rates.h"
#include "costate/assembly/sliding_terms.h"

namespace costate {

Eigen::VectorXd acceleration_rates(Assembly& assembly, AccelerationLevel& level) {
  const int n = assembly.n(), m = assembly.m();
  const StateView s = level.state();
  const Stabilization& st = level.stabilization();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n + m);
  // The rate of R2 at a' = 0 is Phiddd + 2 xi omega Phidd + omega^2 Phid.
  calc_motion_rates(assembly, s, x.data(), x.data() + n);
  if (st.omega != 0) {
    const double c1 = st.by_rate(), c0 = st.by_value();
    const SparsePattern& J = assembly.jacobian();
    Eigen::VectorXd speed = Eigen::Map<const Eigen::VectorXd>(assembly.phi_t.data(), m);
    add_product(J, assembly.phi_q.data(), 1, s.v, speed.data());
    for (int i = 0; i < m; ++i)
      x[n + i] += c1 * assembly.bias[static_cast<std::size_t>(i)] + (assembly.holds_position(i) ? c0 * speed[i] : 0);
    add_product(J, assembly.phi_q.data(), c1, s.a, x.data() + n);
  }
  for (int i = 0; i < m; ++i)
    if (!assembly.is_there(i)) x[n + i] = 0;  // its multiplier is 0, or friction
  add_sliding_rates(assembly, s, x.data() + n);
  x = -x;
  level.solve_kkt(x.data());
  return x;
}

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
