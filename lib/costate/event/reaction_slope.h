// How forces of contact depend on the motion's state: the derivatives of w^T lambda, by which an event depends on it
// whose guard holds multipliers. With lambda of index 1,
//   KKT [a; lambda] = [Q; -bias],   KKT^T y = [0; w]:   d(w^T lambda) = -y^T [R1_x dx + R1_rho drho; R2_x dx + R2_rho
//   drho]
// and along the motion w^T lambda' (level/acceleration_rates.h). Every formulation has these multipliers, of soft
// constraints but for their softness.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "costate/level/acceleration_level.h"

namespace costate {

class ReactionSlope {
 public:
  /// For the mechanism and the parameters of this assembly.
  explicit ReactionSlope(const Assembly& assembly);

  struct Slope {
    Eigen::VectorXd x, rho;      // by (q, v, z) and by the parameters
    double rate = 0, terms = 0;  // w^T lambda', and |w|^T |lambda'|
  };
  /// lambda (m) at (t, q, v, z) and the numbers of `rho`; valid until the next call.
  const double* solve(StateView s, const std::vector<double>& rho);
  /// Of weights w (m), once, where solve() was last.
  Slope slope(const Eigen::VectorXd& weights);

 private:
  Assembly assembly_;
  std::unique_ptr<AccelerationLevel> level_;
};

}  // namespace costate
