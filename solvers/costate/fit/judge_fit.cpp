// What data tell of parameters, from the residuals' tangents at the solution.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "costate/fit/fit.h"

namespace costate {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// P(|T| < t): with tan(a) = t/sqrt(n) the density of Student's distribution is that of cos(a)^(n-1).
double two_sided_probability(double t, int n) {
  if (n == 0) return std::erf(t / std::numbers::sqrt2);
  const auto area = [&](double to) {
    constexpr int pieces = 2000;
    double sum = 0;
    for (int k = 0; k < pieces; ++k) {
      const double h = to / pieces, a = k * h;
      const auto f = [&](double x) { return std::pow(std::cos(x), n - 1); };
      sum += h / 6 * (f(a) + 4 * f(a + h / 2) + f(a + h));
    }
    return sum;
  };
  return area(std::atan(t / std::sqrt(static_cast<double>(n)))) / area(std::numbers::pi / 2);
}

}  // namespace

double two_sided_quantile(double probability, int degrees_of_freedom) {
  // Beyond some thousands it is the normal distribution.
  const int n = degrees_of_freedom > 2000 ? 0 : degrees_of_freedom;
  double low = 0, high = 1;
  while (two_sided_probability(high, n) < probability && high < 1e6) high *= 2;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (two_sided_probability(middle, n) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// With r(rho) of unit variance, C = (J^T J)^-1. In scaled parameters J = U S V^T: a direction V_i with S_i at the
// errors of J is told by nothing in the data.
void judge_fit(const Eigen::MatrixXd& r_rho, const FitOptions& options, double resolution, FitResult& result) {
  const Eigen::Index n = r_rho.cols();
  result.covariance = Eigen::MatrixXd::Constant(n, n, kNone);
  result.correlation = result.covariance;
  result.identifiability.clear();
  std::vector<Eigen::Index> free;
  for (Eigen::Index j = 0; j < n; ++j) {
    FittedParameter& p = result.parameters[static_cast<std::size_t>(j)];
    p.standard_error = p.confidence_lower = p.confidence_upper = kNone;
    if (!p.at_bound) free.push_back(j);
  }
  result.degrees_of_freedom = static_cast<int>(r_rho.rows()) - static_cast<int>(free.size());
  const auto name = [&](Eigen::Index j) {
    return "'" + result.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(j)])].name + "'";
  };
  for (const FittedParameter& p : result.parameters)
    if (p.at_bound)
      result.identifiability.push_back(
          fmt::format("'{}' has come to its bound {:.9g}: the data would have it further; it has no interval, and "
                      "those of the others "
                      "hold with it there.",
                      p.name, p.value));
  if (free.empty()) return;
  const auto m = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd J(r_rho.rows(), m);
  Eigen::VectorXd scale(m);
  for (Eigen::Index j = 0; j < m; ++j) {
    const FittedParameter& p = result.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(j)])];
    scale[j] = std::max(std::abs(p.value), 1e-3 * p.scale);
    J.col(j) = r_rho.col(free[static_cast<std::size_t>(j)]) * scale[j];
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd s = svd.singularValues();
  std::vector<bool> lost(static_cast<std::size_t>(m), false);
  for (Eigen::Index i = 0; i < m; ++i) {
    if (i < s.size() && s[i] > resolution * s[0]) continue;
    // The parameters that take part in the direction.
    Eigen::VectorXd v = Eigen::VectorXd::Zero(m);
    if (i < svd.matrixV().cols()) v = svd.matrixV().col(i);
    std::vector<std::string> with;
    std::vector<double> parts;
    for (Eigen::Index j = 0; j < m; ++j)
      if (std::abs(v[j]) > 0.1 * v.cwiseAbs().maxCoeff()) {
        lost[static_cast<std::size_t>(j)] = true;
        with.push_back(name(j));
        parts.push_back(v[j] * (parts.empty() || parts[0] > 0 ? 1 : -1));
      }
    result.identifiability.push_back(
        with.size() == 1
            ? fmt::format("{} is not identified: nothing in the data depends on it.", with[0])
            : fmt::format(
                  "{} are not identified: the data do not change where they change together (by parts {:.2g} of "
                  "their values). Hold one of them, or measure what tells them apart.",
                  fmt::join(with, ", "), fmt::join(parts, " : ")));
  }
  const auto any_lost = std::find(lost.begin(), lost.end(), true) != lost.end();
  if (result.degrees_of_freedom < 0 || s.size() < m) {
    for (Eigen::Index j = 0; j < m; ++j) lost[static_cast<std::size_t>(j)] = true;
    result.identifiability.push_back(fmt::format("{} residuals are too few for {} parameters.", r_rho.rows(), m));
  }
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(m, m);
  for (Eigen::Index i = 0; i < s.size(); ++i)
    if (s[i] > resolution * s[0]) C += svd.matrixV().col(i) * svd.matrixV().col(i).transpose() / (s[i] * s[i]);
  const int dof = result.degrees_of_freedom;
  const double per = dof > 0 ? result.chi_square / dof : kNone;
  if (options.sigma_from_residuals) C *= per;
  const double t = two_sided_quantile(options.confidence, options.sigma_from_residuals ? std::max(dof, 1) : 0);
  for (Eigen::Index j = 0; j < m; ++j) {
    FittedParameter& p = result.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(j)])];
    if (lost[static_cast<std::size_t>(j)]) {
      p.identified = false;
      continue;
    }
    p.standard_error = std::sqrt(C(j, j)) * scale[j];
    p.confidence_lower = p.value - t * p.standard_error;
    p.confidence_upper = p.value + t * p.standard_error;
    if (p.standard_error > 0.5 * std::abs(p.value) && p.value != 0)
      result.identifiability.push_back(fmt::format("{} is hardly identified: its standard error is {:.0f} % of it.",
                                                   name(j), 100 * p.standard_error / std::abs(p.value)));
    for (Eigen::Index i = 0; i < m; ++i) {
      if (lost[static_cast<std::size_t>(i)]) continue;
      const Eigen::Index a = free[static_cast<std::size_t>(i)], b = free[static_cast<std::size_t>(j)];
      result.covariance(a, b) = C(i, j) * scale[i] * scale[j];
      result.correlation(a, b) = C(i, j) / std::sqrt(C(i, i) * C(j, j));
      if (i < j && std::abs(result.correlation(a, b)) > 0.98)
        result.identifiability.push_back(fmt::format("{} and {} are hardly told apart: their correlation is {:.4f}.",
                                                     name(i), name(j), result.correlation(a, b)));
    }
  }
  // The sum of squares of N - p normal residuals has the mean N - p and the variance 2 (N - p).
  if (dof > 0 && !options.sigma_from_residuals && !any_lost && std::abs(per - 1) > 5 * std::sqrt(2.0 / dof))
    result.identifiability.push_back(fmt::format(
        "The residuals are {:.3g} times as large as the given sigmas say: {}. Intervals follow from the sigmas; "
        "--sigma-from-residuals takes them from the residuals.",
        std::sqrt(per),
        per > 1 ? "the model does not hold all of what was measured, or the sigmas are too small"
                : "the sigmas are too large"));
}

}  // namespace costate
