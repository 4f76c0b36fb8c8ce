// The multipliers of a cycle, eigenvalues of its return map's derivative P, and what they may be off by, from P at two
// tolerances. A multiplier's own change between these may be small by chance. With u and w its left and right
// eigenvectors that is u^T dP w/u^T w: without what cancels among these terms, as the root of the sum of their squares,
// it is no smaller by chance, but too large where errors of the fixed point and of the section change all of P in step.
// Between the two lies what it is off by.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace costate {

/// Largest modulus first, without the `trivial` smallest ones, of the derivative P of a return map.
std::vector<std::complex<double>> multipliers_of(const Eigen::MatrixXd& P, int trivial);

/// Of the eigenvalue of P next to m: the larger of its change to that of `other` and the geometric mean of that and of
/// the root of the terms' squares. No scaling of coordinates changes it.
double multiplier_error(const Eigen::MatrixXd& P, const Eigen::MatrixXd& other, std::complex<double> m);

}  // namespace costate
