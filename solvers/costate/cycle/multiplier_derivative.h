// How the largest multiplier changes as the cycle follows the parameters (lib/README.md (18.8)): with u and w its left
// and right eigenvectors, u^T w = 1,
//   m' = u^T (D_w P_x x_rho + D_w P_rho),   |m|' = Re(conj(m) m')/|m|
// where D_w is the derivative along w of the exact first derivatives of the return map. Second derivatives are not
// carried through events: D_w is taken from differences of these tangents at x +- h w, extrapolated to h = 0, and comes
// with an estimate of its error.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/cycle/return_map.h"

namespace costate {

struct MultiplierDerivative {
  Eigen::VectorXd by_rho, error;  // of the modulus, one entry a parameter
  Counters counters;
};

/// x: the fixed point; the map's first `parameters` parameters count. Throws CapabilityError where the largest modulus
/// has no derivative or the runs next to the cycle meet other events.
MultiplierDerivative multiplier_derivative(const ReturnMap& map, const Eigen::VectorXd& x,
                                           const std::vector<double>& positions, int parameters);

/// A sentence for results that hold such a derivative: by what method, and how exact.
std::string multiplier_method(const MultiplierDerivative& d);

}  // namespace costate
