// The Hessian of psi: p products (hessian/hessian_products.h) for p parameters, of one pair of runs.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/hessian/hessian_products.h"

namespace costate {

/// H times each column of `directions`, of psi over a cycle, too.
HessianProducts products_of(const Problem& problem, const std::vector<double>& rho, const Eigen::MatrixXd& directions);

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

Hessian hessian(const Problem& problem, const std::vector<double>& rho);

/// At a tenth of the problem's rtol, and its product with one direction at rtol itself (of the penalties with firmer
/// constraints): `error` is a third of what these differ by (all of it). Where the tighter run fails it is that at
/// rtol, whose error is not known: infinite.
Hessian confirmed_hessian(const Problem& problem, const std::vector<double>& rho);

}  // namespace costate
