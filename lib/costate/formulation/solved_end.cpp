#include "costate/formulation/solved_end.h"

namespace costate {

void eliminate_at_end(AccelerationLevel& level, Assembly& assembly, const StateView& s, ScalarGradient& g, double c,
                      double* gradient) {
  // tau = KKT^-1 [w_a; w_l]
  Eigen::VectorXd tau(assembly.n() + assembly.m());
  tau << g.a, g.lambda;
  level.solve_kkt(tau.data());
  level.add_transposed(-1, tau.data(), tau.data() + assembly.n(), nullptr, g.q.data(), g.v.data(), g.z.data());
  const Stabilization& st = level.stabilization();
  Assembly::ParameterWeights w;
  w.force = tau.data();
  w.row = tau.data() + assembly.n();
  w.c0 = st.omega * st.omega;
  w.c1 = 2 * st.xi * st.omega;
  w.c2 = 1;
  if (gradient) assembly.add_parameter_gradient(s, w, -c, gradient);
}

}  // namespace costate
