#include "costate/sensitivity/hessian.h"

#include <algorithm>
#include <limits>

#include "costate/base/error.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/sensitivity/cycle_hessian.h"
#include "costate/sensitivity/error_estimate.h"

namespace costate {

using Eigen::MatrixXd;

HessianProducts products_of(const Problem& problem, const std::vector<double>& rho, const MatrixXd& directions) {
  return problem.cycle ? cycle_hessian_products(problem, rho, directions) : hessian_products(problem, rho, directions);
}

Hessian hessian(const Problem& problem, const std::vector<double>& rho) {
  const Eigen::Index np = problem.parameters.size();
  HessianProducts p = products_of(problem, rho, MatrixXd::Identity(np, np));
  Hessian h;
  h.psi = p.psi;
  h.gradient = std::move(p.gradient);
  h.counters = p.counters;
  const Eigen::VectorXd scale = scales(problem.parameters);
  const double largest = largest_scaled(scale, p.products);
  if (largest > 0) h.asymmetry = largest_scaled(scale, p.products - p.products.transpose()) / largest;
  h.matrix = (p.products + p.products.transpose()) / 2;
  h.error = h.asymmetry;
  return h;
}

Hessian confirmed_hessian(const Problem& problem, const std::vector<double>& rho) {
  constexpr double kTighter = 0.1, kTightest = 1e-13, kOfChange = 1.0 / 3, kOfSoftness = 1 / 0.9;
  Problem tight = problem;
  tight.solver.tighten(kTighter, std::min(kTightest, problem.solver.rtol));
  Hessian h;
  try {
    h = hessian(tight, rho);
  } catch (const SolverError&) {
    h = hessian(problem, rho);
    h.error = std::numeric_limits<double>::infinity();
    return h;
  }
  const auto np = static_cast<Eigen::Index>(rho.size());
  if (np == 0) return h;
  // Of every parameter, and of no symmetry that a mechanism has.
  const Eigen::VectorXd scale = scales(problem.parameters);
  Eigen::VectorXd direction(np);
  for (Eigen::Index j = 0; j < np; ++j)
    direction[j] = (j % 3 == 1 ? -1 : 1) * scale[j] * (1 + 0.1 * static_cast<double>(j % 7));
  // Soft constraints are made firmer at the same time: what they add is of first order in 1/alpha.
  const bool soft = has_soft_constraints(problem.formulation);
  const HessianProducts loose = products_of(soft ? with_firmer_constraints(problem) : problem, rho, direction);
  h.counters += loose.counters;
  const double largest = largest_scaled(scale, h.matrix),
               change = scale.cwiseProduct(h.matrix * direction - loose.products.col(0)).cwiseAbs().maxCoeff();
  if (largest > 0) h.error = std::max(h.error, (soft ? kOfSoftness : kOfChange) * change / largest);
  return h;
}

}  // namespace costate
