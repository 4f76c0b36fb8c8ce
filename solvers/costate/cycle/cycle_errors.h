// What a cycle may be off by, from two searches at two tolerances, which may come near each other by chance.
//
// What a multiplier may be off by, from the return map's derivatives P at two tolerances. Its own change between them
// may be small by chance. With u and w its left and right eigenvectors that is u^T dP w/u^T w: without what cancels
// among these terms, as the root of the sum of their squares, it is no smaller by chance, but too large where errors of
// the fixed point and of the section change all of P in step. Between the two lies what it is off by.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "costate/cycle/section.h"

namespace costate {

/// Of the eigenvalue of P next to m: the larger of its change to that of `other` and the geometric mean of that and of
/// the root of the terms' squares. No scaling of coordinates changes it.
double multiplier_error(const Eigen::MatrixXd& P, const Eigen::MatrixXd& other, std::complex<double> m);

/// Of positions and speeds among the entries of x: none is known to a smaller part of itself than three tenths of the
/// largest error, of lengths or of angles, over the largest of those; speeds count as what swings with the period [s].
void pool_errors(const std::vector<SectionCoordinate>& coordinates, double period, const Eigen::VectorXd& x,
                 Eigen::VectorXd& error);

}  // namespace costate
