#include "costate/cycle/cycle_errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {
/// Per unit of x, of lengths ("m") or of angles ("rad"): positions, and speeds by how far one that swings with the
/// period goes; 0 for others.
double way(const std::string& kind, const std::string& unit, double period) {
  return unit == kind ? 1.0 : unit == kind + "/s" ? period / (2 * std::numbers::pi) : 0.0;
}
const std::string kKinds[] = {"m", "rad"};
}  // namespace

Eigen::VectorXd comparable_sizes(const std::vector<std::string>& units, double period, const Eigen::VectorXd& x) {
  const auto unit = [&](Eigen::Index i) -> const std::string& { return units[static_cast<std::size_t>(i)]; };
  Eigen::VectorXd size = Eigen::VectorXd::Zero(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i)
    for (Eigen::Index j = 0; j < x.size(); ++j)
      if (unit(i) == unit(j)) size[i] = std::max(size[i], std::abs(x[j]));
  for (const std::string& kind : kKinds)
    for (Eigen::Index i = 0; i < x.size(); ++i)
      for (Eigen::Index j = 0; j < x.size(); ++j)
        if (const double own = way(kind, unit(i), period), other = way(kind, unit(j), period); own > 0 && other > 0)
          size[i] = std::max(size[i], other / own * std::abs(x[j]));
  return size;
}

void pool_errors(const std::vector<std::string>& units, double period, const Eigen::VectorXd& x, Eigen::VectorXd& error,
                 bool anyhow) {
  constexpr double kAtRest = 1e-3;
  const Eigen::VectorXd size = comparable_sizes(units, period, x);
  for (const std::string& kind : kKinds) {
    double most = 0;  // of the sizes
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (way(kind, units[static_cast<std::size_t>(i)], period) > 0 && size[i] > 0)
        most = std::max(most, error[i] / size[i]);
    if (!anyhow && most > kAtRest) continue;
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (way(kind, units[static_cast<std::size_t>(i)], period) > 0)
        error[i] = std::max(error[i], kByChance * most * std::abs(x[i]));
  }
}

double scaled_size(const Eigen::VectorXd& by, const ParameterSelection& parameters) {
  return by.cwiseProduct(scales(parameters).head(by.size())).lpNorm<Eigen::Infinity>();
}

Eigen::VectorXd derivative_errors(const Eigen::VectorXd& by, const Eigen::VectorXd& loose,
                                  const ParameterSelection& parameters) {
  Eigen::VectorXd error = (by - loose).cwiseAbs();
  const double size = scaled_size(by, parameters), most = scaled_size(error, parameters);
  if (size > 0) error = error.cwiseMax(kByChance * most / size * by.cwiseAbs());
  return error;
}

Eigen::MatrixXd derivative_errors(const std::vector<std::string>& units, double period, const Eigen::MatrixXd& by,
                                  const Eigen::MatrixXd& loose, const ParameterSelection& parameters) {
  Eigen::MatrixXd errors(by.rows(), by.cols());
  for (Eigen::Index i = 0; i < by.rows(); ++i) errors.row(i) = derivative_errors(by.row(i), loose.row(i), parameters);
  for (Eigen::Index j = 0; j < by.cols(); ++j) {
    Eigen::VectorXd error = errors.col(j);
    pool_errors(units, period, by.col(j), error, true);
    errors.col(j) = error;
  }
  return errors;
}

double relative_error(const std::vector<std::string>& units, double period, const Eigen::MatrixXd& by,
                      const Eigen::MatrixXd& error, const ParameterSelection& parameters) {
  Eigen::VectorXd rows(by.rows());
  for (Eigen::Index i = 0; i < by.rows(); ++i) rows[i] = scaled_size(by.row(i), parameters);
  const Eigen::VectorXd sizes = comparable_sizes(units, period, rows);
  double most = 0;
  for (Eigen::Index i = 0; i < by.rows(); ++i)
    if (sizes[i] > 0) most = std::max(most, scaled_size(error.row(i), parameters) / sizes[i]);
  return most;
}

}  // namespace costate
