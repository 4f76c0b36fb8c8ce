// Exact second derivatives of psi: products H d of its Hessian with directions of the parameters, by one run
// of the motion with its tangents and one of the adjoint with its changes back along it (lib/README.md (13)).
// A Hessian of p parameters is p products of one pair of runs.
#pragma once

#include <Eigen/Core>
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

struct Hessian {
  double psi = 0;
  std::vector<double> gradient;
  Eigen::MatrixXd matrix;  // np x np; symmetric, the mean of what the products gave and its transpose
  /// The largest |H_ij - H_ji| of the products in scaled parameters, against the largest entry: exact second
  /// derivatives are symmetric, so this is what the integrators' tolerances leave.
  double asymmetry = 0;
  /// What is known of how far the matrix is off, against its largest entry in scaled parameters: the asymmetry, or
  /// more.
  double error = 0;
  Counters counters;
};

/// Empty when the formulation offers Hessian-vector products; otherwise why not, and which formulations do.
std::string hessian_refusal(const Formulation& formulation);

/// H times each column of `directions` (np x k), at rho. Runs on CVODES at the problem's tolerance. Throws
/// CapabilityError where the formulation or a term of the cost offers no second derivatives.
HessianProducts hessian_products(const Problem& problem, const std::vector<double>& rho,
                                 const Eigen::MatrixXd& directions);

Hessian hessian(const Problem& problem, const std::vector<double>& rho);

/// At a tenth of the problem's rtol, and its product with one direction at rtol itself (of the penalties with firmer
/// constraints): `error` is a third of what these differ by (all of it). Where the tighter run fails it is that at
/// rtol, whose error is not known: infinite.
Hessian confirmed_hessian(const Problem& problem, const std::vector<double>& rho);

}  // namespace costate
