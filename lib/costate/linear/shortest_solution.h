// Small dense systems whose rows may depend on each other, as those of several contacts of one body do.
#pragma once

#include <Eigen/Dense>

namespace costate {

/// x of A x = c, A square; where rows depend on each other the shortest one.
inline Eigen::VectorXd shortest_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& c) {
  if (A.size() == 0) return Eigen::VectorXd::Zero(A.cols());
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(A);
  if (lu.isInvertible()) return lu.solve(c);
  return A.completeOrthogonalDecomposition().solve(c);
}

}  // namespace costate
