#include "costate/level/acceleration_rates.h"

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

}  // namespace costate
