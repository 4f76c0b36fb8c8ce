// Exact second derivatives of psi: products H d of its Hessian with directions of the parameters, by one run
// of the motion with its tangents and one of the adjoint with its changes back along it (lib/README.md (13)).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

struct HessianProducts {
  double psi = 0;  // of the motion that these runs found
  std::vector<double> gradient;
  Eigen::MatrixXd products;  // np x k: H times each direction
  Counters counters;
};

/// Empty when the formulation offers Hessian-vector products; otherwise why not, and which formulations do.
std::string hessian_refusal(const Formulation& formulation);

/// H times each column of `directions` (np x k), at rho. Runs on CVODES at the problem's tolerance. Throws
/// CapabilityError where the formulation or a term of the cost offers no second derivatives.
HessianProducts hessian_products(const Problem& problem, const std::vector<double>& rho,
                                 const Eigen::MatrixXd& directions);
/// The same of a problem to the fixed time at which `end` happens, with end_term() of it in its cost (as
/// with_fixed_end() makes it). `start_weights` (n, or none): psi gains w^T q at the start.
HessianProducts hessian_products_until(const Problem& problem, const std::optional<EndEvent>& end,
                                       const std::vector<double>& rho, const Eigen::MatrixXd& directions,
                                       const Eigen::VectorXd& start_weights = {});

}  // namespace costate
