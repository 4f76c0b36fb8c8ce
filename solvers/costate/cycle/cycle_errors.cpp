#include "costate/cycle/cycle_errors.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "costate/base/error.h"

namespace costate {

double multiplier_error(const Eigen::MatrixXd& P, const Eigen::MatrixXd& other, std::complex<double> m) {
  if (P.rows() == 0) return 0;
  const Eigen::EigenSolver<Eigen::MatrixXd> right(P), left(P.transpose().eval()), changed(other, false);
  for (const auto* solver : {&right, &left, &changed})
    if (solver->info() != Eigen::Success)
      throw SolverError("The eigenvalue problem of the multipliers did not converge.");
  const auto nearest = [](const Eigen::VectorXcd& of, std::complex<double> to) {
    Eigen::Index k = 0;
    (of.array() - to).abs().minCoeff(&k);
    return k;
  };
  const Eigen::VectorXcd all = right.eigenvalues();
  const Eigen::Index k = nearest(all, m);
  const double change = std::abs(changed.eigenvalues()[nearest(changed.eigenvalues(), all[k])] - all[k]);
  const Eigen::VectorXcd w = right.eigenvectors().col(k),
                         u = left.eigenvectors().col(nearest(left.eigenvalues(), all[k]));
  const double product = std::abs((u.transpose() * w).value()),
               sum = (u.cwiseAbs() * w.cwiseAbs().transpose()).cwiseProduct(other - P).norm();
  double next = std::numeric_limits<double>::infinity();  // the distance to the next one
  for (Eigen::Index i = 0; i < all.size(); ++i)
    if (i != k) next = std::min(next, std::abs(all[i] - all[k]));
  double terms = product > 0 ? sum / product : 0;
  // From where two meet they move apart as the root of what changes.
  if (terms > next) terms = std::sqrt(terms * next);
  return std::max(change, std::sqrt(change * terms));
}

void pool_errors(const std::vector<SectionCoordinate>& coordinates, double period, const Eigen::VectorXd& x,
                 Eigen::VectorXd& error) {
  constexpr double kByChance = 0.3, kAtRest = 1e-3;
  for (const std::string unit : {"m", "rad"}) {
    // Per unit of x: positions, and speeds by how far one that swings with the period goes; zero for others.
    const auto way = [&](Eigen::Index i) {
      const std::string& own = coordinates[static_cast<std::size_t>(i)].unit;
      return own == unit ? 1.0 : own == unit + "/s" ? period / (2 * std::numbers::pi) : 0.0;
    };
    double size = 0, most = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      size = std::max(size, way(i) * std::abs(x[i]));
      most = std::max(most, way(i) * error[i]);
    }
    if (!(size > 0) || most > kAtRest * size) continue;  // nothing of this unit moves
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (way(i) > 0) error[i] = std::max(error[i], kByChance * most / size * std::abs(x[i]));
  }
}

}  // namespace costate
