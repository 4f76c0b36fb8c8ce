#include "costate/cycle/cycle_errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace costate {

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

Eigen::VectorXd derivative_errors(const Eigen::VectorXd& by, const Eigen::VectorXd& loose,
                                  const std::vector<Parameter>& parameters) {
  constexpr double kByChance = 0.3;
  Eigen::VectorXd error = (by - loose).cwiseAbs();
  double size = 0, most = 0;
  for (Eigen::Index j = 0; j < by.size(); ++j) {
    const double scale = parameters[static_cast<std::size_t>(j)].scale;
    size = std::max(size, scale * std::abs(by[j]));
    most = std::max(most, scale * error[j]);
  }
  if (size > 0) error = error.cwiseMax(kByChance * most / size * by.cwiseAbs());
  return error;
}

Eigen::MatrixXd derivative_errors(const std::vector<SectionCoordinate>& coordinates, double period,
                                  const Eigen::MatrixXd& by, const Eigen::MatrixXd& loose,
                                  const std::vector<Parameter>& parameters) {
  Eigen::MatrixXd errors(by.rows(), by.cols());
  for (Eigen::Index i = 0; i < by.rows(); ++i) errors.row(i) = derivative_errors(by.row(i), loose.row(i), parameters);
  for (Eigen::Index j = 0; j < by.cols(); ++j) {
    Eigen::VectorXd error = errors.col(j);
    pool_errors(coordinates, period, by.col(j), error);
    errors.col(j) = error;
  }
  return errors;
}

}  // namespace costate
