// The eigenvalues of a real matrix whose entries may differ by many orders of magnitude, each with what is known of it.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace costate {

struct Root {
  std::complex<double> value;  // of a conjugate pair the one above the real axis
  Eigen::VectorXcd vector;     // right eigenvector
  /// How far the root moves, at most, for changes of the entries by rounding of the terms that they are sums of; of a
  /// double root with one vector (critical damping) in proportion to their square root.
  double error = 0;
};

struct Roots {
  std::vector<Root> roots;  // without the zeros
  int zeros = 0;            // eigenvalues that such changes can make zero
};

/// `terms` has the sum of the absolute values of the terms of each entry of A: what rounding in it is measured by.
/// Uncoupled parts of A are computed by themselves; each is balanced, its zeros are split off, and its other roots come
/// from the QR iteration. Those that this cannot tell from the rounding of larger ones are then found by Aberth's
/// iteration,
///   x_i -= 1 / (tr (x_i - A)^-1 - sum_(j != i) 1 / (x_i - x_j)),
/// which takes the known ones out. Throws SolverError where an iteration does not end.
Roots find_roots(Eigen::MatrixXd A, const Eigen::MatrixXd& terms);

}  // namespace costate
