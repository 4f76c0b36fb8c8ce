// How the largest multiplier changes as the cycle follows the parameters (lib/README.md (18.8)): with u and w its left
// and right eigenvectors, u^T w = 1,
//   m' = u^T (D_w P_x x_rho + D_w P_rho),   |m|' = Re(conj(m) m')/|m|
// where u^T D_w is the derivative along w of those of u^T P, by Hessian products. Where second derivatives are not
// carried along (an event that has none) it is taken from differences of tangents at x +- h w, extrapolated to h = 0.
// Both come with an estimate of their error.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "costate/cycle/return_map.h"

namespace costate {

struct MultiplierDerivative {
  Eigen::VectorXd by_rho, error;  // of the modulus, one entry a parameter
  std::string not_exact;          // why differences were taken; empty: they were not
  Counters counters;
};

/// x: the fixed point; the map's first `parameters` parameters count. Throws CapabilityError where the largest modulus
/// has no derivative or the runs next to the cycle meet other events.
MultiplierDerivative multiplier_derivative(const ReturnMap& map, const Eigen::VectorXd& x,
                                           const std::vector<double>& positions, int parameters);

/// A sentence for results that hold such a derivative: by what method, and how exact.
std::string multiplier_method(const MultiplierDerivative& d);

}  // namespace costate
