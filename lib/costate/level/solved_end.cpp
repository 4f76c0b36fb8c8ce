#include "costate/level/solved_end.h"

namespace costate {

Eigen::VectorXd eliminate_at_end(AccelerationLevel& level, Assembly& assembly, const StateView& s, ScalarGradient& g,
                                 double c, double* gradient) {
  Eigen::VectorXd tau(assembly.n() + assembly.m());
  tau << g.a, g.lambda;
  level.solve_kkt_transposed(tau.data());
  level.add_transposed(-1, tau.data(), tau.data() + assembly.n(), nullptr, g.q.data(), g.v.data(), g.z.data());
  const auto w = level.stabilization().weights(tau.data(), tau.data() + assembly.n());
  if (gradient) assembly.add_parameter_gradient(s, w, -c, gradient);
  return tau;
}

}  // namespace costate
