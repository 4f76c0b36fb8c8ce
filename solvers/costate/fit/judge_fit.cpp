// What data tell of parameters, from the residuals' tangents at the solution.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "costate/base/notice.h"
#include "costate/fit/fit.h"

namespace costate {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// Tangents of this part of the largest are zero; and parts of a direction, beside its numerical errors.
constexpr double kRounding = 1e-13, kTakesPart = 1e-2;
// Tangents whose errors are a larger part of them tell nothing; and so many times its errors a direction is to be seen.
constexpr double kNoise = 0.3, kBeyond = 3, kLeastResolution = 1e-10;
// Of standard errors: integration that moves a parameter less is not worth a word.
constexpr double kMoved = 0.3;
// Of the variance of residuals: what the sum of squares may still fall by at what is told as the least, by steps of a
// tenth of the standard errors.
constexpr double kLeft = 0.01, kOfErrors = 10;

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

// With r(rho) of unit variance, C = (J^T J)^-1. With columns of length 1 J = U S V^T: a direction V_i with S_i at the
// errors of J is told by nothing in the data. Errors e of r move the minimum by -C J^T e.
void judge_fit(const SampleResiduals& at, const std::vector<SampleResiduals>& others, const FitOptions& options,
               FitResult& result) {
  const Eigen::MatrixXd& r_rho = at.r_rho;
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
  // Whether parameters are told apart does not depend on their sizes: columns of length 1. How much of a parameter's
  // own size the data tell does.
  Eigen::MatrixXd J(r_rho.rows(), m), errors(r_rho.rows(), m);
  Eigen::VectorXd length(m), weight(m);
  for (Eigen::Index j = 0; j < m; ++j) {
    const FittedParameter& p = result.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(j)])];
    J.col(j) = r_rho.col(free[static_cast<std::size_t>(j)]);
    errors.col(j) = others.front().r_rho.col(free[static_cast<std::size_t>(j)]) - J.col(j);
    length[j] = J.col(j).norm();
    weight[j] = length[j] * std::max(std::abs(p.value), 1e-3 * p.scale);
  }
  const double largest = weight.maxCoeff();
  std::vector<bool> lost(static_cast<std::size_t>(m), false);
  std::vector<Eigen::Index> seen;
  for (Eigen::Index j = 0; j < m; ++j) {
    const bool any = length[j] > 0 && weight[j] > kRounding * largest;
    if (const double error = errors.col(j).norm(); any && error <= kNoise * length[j]) {
      J.col(static_cast<Eigen::Index>(seen.size())) = J.col(j) / length[j];
      errors.col(static_cast<Eigen::Index>(seen.size())) = errors.col(j) / length[j];
      seen.push_back(j);
      continue;
    }
    lost[static_cast<std::size_t>(j)] = true;
    result.identifiability.push_back(
        any ? fmt::format("{} is not identified: the data change with it by less than the errors of integration do.",
                          name(j))
            : fmt::format("{} is not identified: nothing in the data depends on it, to first order where it is.",
                          name(j)));
  }
  const auto count = static_cast<Eigen::Index>(seen.size());
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(m, m);
  if (r_rho.rows() < m) {
    lost.assign(static_cast<std::size_t>(m), true);
    result.identifiability.push_back(fmt::format("{} residuals are too few for {} parameters.", r_rho.rows(), m));
  } else if (count > 0) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J.leftCols(count), Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Eigen::VectorXd s = svd.singularValues();
    const double least = std::max(kBeyond * errors.leftCols(count).norm(), kLeastResolution * s[0]);
    Eigen::Index rank = 0;
    while (rank < count && s[rank] > least) ++rank;
    result.degrees_of_freedom = static_cast<int>(r_rho.rows() - rank);
    const Eigen::MatrixXd unseen = svd.matrixV().rightCols(count - rank);
    // A parameter that takes part in what the data do not see can be anything.
    std::vector<std::string> with, parts;
    double first = 0;
    for (Eigen::Index k = 0; k < count; ++k) {
      if (!(unseen.row(k).norm() > kTakesPart)) continue;
      const Eigen::Index j = seen[static_cast<std::size_t>(k)];
      lost[static_cast<std::size_t>(j)] = true;
      with.push_back(name(j));
      const double change = unseen(k, 0) / length[j];
      if (first == 0) first = change;
      parts.push_back(fmt::format("{:.3g}", change / first));
    }
    if (unseen.cols() == 1)
      result.identifiability.push_back(
          fmt::format("{} are not identified: the data do not change where they change together, as {}. Hold one of "
                      "them, or measure what tells them apart.",
                      fmt::join(with, ", "), fmt::join(parts, " : ")));
    else if (unseen.cols() > 1)
      result.identifiability.push_back(
          fmt::format("{} are not identified: they can change together in {} ways that the data do not see. Hold as "
                      "many of them, or measure what tells them apart.",
                      fmt::join(with, ", "), unseen.cols()));
    for (Eigen::Index i = 0; i < rank; ++i)
      for (Eigen::Index k = 0; k < count; ++k)
        for (Eigen::Index l = 0; l < count; ++l) {
          const Eigen::Index a = seen[static_cast<std::size_t>(k)], b = seen[static_cast<std::size_t>(l)];
          C(a, b) += svd.matrixV()(k, i) * svd.matrixV()(l, i) / (s[i] * s[i] * length[a] * length[b]);
        }
  }
  const int dof = result.degrees_of_freedom;
  const double per = dof > 0 ? result.chi_square / dof : kNone;
  // Two runs may come near each other by chance: the farther one tells.
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(m);
  double of_errors = 0;  // what such a move changes the sum of squares by
  for (const SampleResiduals& other : others) {
    Eigen::VectorXd projected(m);
    for (Eigen::Index j = 0; j < m; ++j)
      projected[j] = r_rho.col(free[static_cast<std::size_t>(j)]).dot(other.r - at.r);
    moved = moved.cwiseMax((C * projected).cwiseAbs());
    of_errors = std::max(of_errors, projected.dot(C * projected));
  }
  // The step that a search of least squares would make from here: none at the least.
  Eigen::VectorXd slope(m);
  for (Eigen::Index j = 0; j < m; ++j) slope[j] = r_rho.col(free[static_cast<std::size_t>(j)]).dot(at.r);
  const Eigen::VectorXd left = C * slope;
  // No search gets nearer than errors of integration let it.
  if (const double falls = slope.dot(left);
      result.converged && falls > std::max(kLeft * std::max(1.0, dof > 0 ? per : 1.0), kOfErrors * of_errors)) {
    result.converged = false;
    result.termination = fmt::format(
        "stopped short of the least: steps no longer lower the sum of squares, {:.6g}, though to first order it would "
        "fall by {:.2g}. Another start, or a smaller rtol, tells",
        result.chi_square, falls);
  }
  if (options.sigma_from_residuals) C *= per;
  const double t = two_sided_quantile(options.confidence, options.sigma_from_residuals ? std::max(dof, 1) : 0);
  for (Eigen::Index j = 0; j < m; ++j) {
    FittedParameter& p = result.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(j)])];
    if (lost[static_cast<std::size_t>(j)]) {
      p.identified = false;
      continue;
    }
    p.standard_error = std::sqrt(C(j, j));
    p.integration_error = moved[j] + std::abs(left[j]);
    p.confidence_lower = p.value - t * p.standard_error - p.integration_error;
    p.confidence_upper = p.value + t * p.standard_error + p.integration_error;
    if (moved[j] > kMoved * p.standard_error)
      notice(fmt::format(
          "Errors of integration move {} by some {:.2g}, {:.2g} times its standard error, which its interval "
          "includes: a smaller rtol makes them small.",
          name(j), moved[j], moved[j] / p.standard_error));
    if (p.standard_error > 0.5 * std::abs(p.value) && p.value != 0)
      result.identifiability.push_back(fmt::format("{} is hardly identified: its standard error is {:.0f} % of it.",
                                                   name(j), 100 * p.standard_error / std::abs(p.value)));
    for (Eigen::Index i = 0; i < m; ++i) {
      if (lost[static_cast<std::size_t>(i)]) continue;
      const Eigen::Index a = free[static_cast<std::size_t>(i)], b = free[static_cast<std::size_t>(j)];
      result.covariance(a, b) = C(i, j);
      result.correlation(a, b) = C(i, j) / std::sqrt(C(i, i) * C(j, j));
      if (i < j && std::abs(result.correlation(a, b)) > 0.98)
        result.identifiability.push_back(fmt::format("{} and {} are hardly told apart: their correlation is {:.4f}.",
                                                     name(i), name(j), result.correlation(a, b)));
    }
  }
  // The sum of squares of N - p normal residuals has the mean N - p and the variance 2 (N - p).
  if (dof > 0 && !options.sigma_from_residuals && std::abs(per - 1) > 5 * std::sqrt(2.0 / dof))
    result.identifiability.push_back(fmt::format(
        "The residuals are {:.3g} times as large as the given sigmas say: {}. Intervals follow from the sigmas; "
        "--sigma-from-residuals takes them from the residuals.",
        std::sqrt(per),
        per > 1 ? "the model does not hold all of what was measured, or the sigmas are too small"
                : "the sigmas are too large"));
}

}  // namespace costate
