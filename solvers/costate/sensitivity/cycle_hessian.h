// Second derivatives of psi over a cycle that follows the parameters (lib/README.md (18.10)), exactly.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/hessian/hessian_products.h"

namespace costate {

/// H times each column of `directions` (np x k), of psi over the cycle of problem.cycle. Throws CapabilityError where
/// the cost holds the largest multiplier, or second derivatives are not carried along the cycle.
HessianProducts cycle_hessian_products(const Problem& problem, const std::vector<double>& rho,
                                       const Eigen::MatrixXd& directions);

}  // namespace costate
