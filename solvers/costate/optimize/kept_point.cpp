#include "costate/optimize/kept_point.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/optimize/bound_size.h"

namespace costate {

namespace {
// Of a constraint's size: what may be the runs' errors; and of psi, what no such error explains.
constexpr double kOff = 1e-4, kFarBelow = 1e-3;
// A constraint that is so many times as near as the worst one is off takes part.
constexpr double kTakesPart = 10;
}  // namespace

std::optional<std::vector<double>> nearest_kept_point(const std::vector<OptimizerEvaluation>& evaluations,
                                                      std::size_t best, const Design& design) {
  const std::vector<DesignBound> bounds = design.bounds();
  const auto& parameters = design.parameters.parameters;
  if (bounds.empty()) return {};
  const std::vector<double> sizes = bound_sizes(design.parameters, evaluations.front(), bounds);
  // By how much constraint c is beyond half of what still keeps it, in its size.
  const auto beyond = [&](const OptimizerEvaluation& e, std::size_t c) {
    return (e.constraints[c] - 0.5 * kept_within(sizes[c], bounds[c].upper, design.rtol())) / sizes[c];
  };
  const double below = evaluations[best].psi - kFarBelow * std::abs(evaluations[best].psi);
  const OptimizerEvaluation* nearest = nullptr;
  double least = kOff;
  for (const OptimizerEvaluation& e : evaluations) {
    if (e.failed() || !(e.psi < below)) continue;
    double worst = 0;
    for (std::size_t c = 0; c < bounds.size(); ++c) worst = std::max(worst, beyond(e, c));
    if (worst < least) {
      least = worst;
      nearest = &e;
    }
  }
  if (!nearest) return {};
  std::vector<std::size_t> rows;
  for (std::size_t c = 0; c < bounds.size(); ++c)
    if (beyond(*nearest, c) > -kTakesPart * least) rows.push_back(c);
  const auto k = static_cast<Eigen::Index>(rows.size()), n = static_cast<Eigen::Index>(parameters.size());
  Eigen::MatrixXd A(k, n);
  Eigen::VectorXd off(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const std::size_t c = rows[static_cast<std::size_t>(i)];
    off[i] = std::max(0.0, beyond(*nearest, c));
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto at = static_cast<std::size_t>(j);
      A(i, j) = nearest->constraint_gradients[c][at] * parameters[at].scale / sizes[c];
    }
  }
  // Parameters that would leave their bounds stay where they are.
  std::vector<double> rho;
  for (Eigen::Index round = 0; round <= n; ++round) {
    const Eigen::VectorXd step = -A.completeOrthogonalDecomposition().solve(off);
    rho = nearest->rho;
    bool within = true;
    for (Eigen::Index j = 0; j < n; ++j) {
      const Parameter& p = parameters[static_cast<std::size_t>(j)];
      double& at = rho[static_cast<std::size_t>(j)];
      at += step[j] * p.scale;
      if (at >= p.lower && at <= p.upper) continue;
      at = std::clamp(at, p.lower, p.upper);
      if (A.col(j).isZero(0)) continue;
      A.col(j).setZero();
      within = false;
    }
    if (within) break;
  }
  if (rho == nearest->rho) return {};
  return rho;
}

}  // namespace costate
