// Closing a mechanism from a first guess without leaving the guess's branch. With r(q) = [Phi(q, t); B q - z0] and its
// value r0 at the guess, the positions are led along r(q(s)) = (1 - s) r0, s = 0 .. 1, by Newton steps that are short
// against the mechanism and contract: all gaps close together, so that the assembly follows its guess as a hand would
// lead it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

/// A step is measured by this: 1 for one that moves a coordinate by a fifth of the mechanism or turns one by 0.3 rad.
class StepLength {
 public:
  StepLength(const Assembly& assembly, const Eigen::VectorXd& q);
  double operator()(const Eigen::VectorXd& step) const { return (step.array() * weight_.array()).abs().maxCoeff(); }
  const Eigen::VectorXd& weights() const { return weight_; }

 private:
  Eigen::VectorXd weight_;
};

class ClosingPath {
 public:
  /// The given positions have the values z0 (one entry each); `given` must outlive this.
  ClosingPath(Assembly& assembly, double t, const std::vector<GivenStart>& given, Eigen::VectorXd z0);

  Eigen::VectorXd residual(const Eigen::VectorXd& q);
  /// Leads q along the path. False where it ends before s = 1, at a dead position; q then is near that.
  bool follow(Eigen::VectorXd& q);
  /// From q down the sum of the squares of all gaps, by the same short steps; up to 500 coordinates. Leads over dead
  /// positions, but it may settle in another branch, or in none (false).
  bool descend(Eigen::VectorXd& q);

 private:
  Assembly& assembly_;
  const double t_;
  const std::vector<GivenStart>& given_;
  const Eigen::VectorXd z0_;
};

}  // namespace costate
