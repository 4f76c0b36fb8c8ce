#include "costate/cycle/cycle_search.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/base/stop.h"

namespace costate {

namespace {

constexpr int kHalvings = 8;
// A search ends where its next step would be this part of the tolerances, or their errors let it come no nearer.
constexpr double kNear = 1e-3;
// I - P_x is singular where its smallest singular value is below this part of the largest, or of 1 as P_x itself is all
// but 1 at a resonance, or what runs at the tolerance make of zero: their errors are usually 1 to 200 rtol.
constexpr double kSingular = 1e-9, kSingularRuns = 200;

/// Scales s by which P becomes s_i^-1 P_ij s_j with rows and columns of like sizes (Osborne): metres beside radians per
/// second, or a speed that a small angle makes, are no sign that P - 1 is singular.
Eigen::VectorXd balancing(const Eigen::MatrixXd& P) {
  constexpr int kSweeps = 10;
  constexpr double kMost = 1e6;
  Eigen::VectorXd s = Eigen::VectorXd::Ones(P.rows());
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (Eigen::Index i = 0; i < s.size(); ++i) {
      double row = 0, column = 0;
      for (Eigen::Index j = 0; j < s.size(); ++j) {
        if (j == i) continue;
        row = std::max(row, std::abs(P(i, j)) * s[j] / s[i]);
        column = std::max(column, std::abs(P(j, i)) * s[i] / s[j]);
      }
      if (row > 0 && column > 0) s[i] = std::clamp(s[i] * std::sqrt(row / column), 1 / kMost, kMost);
    }
  return s;
}

}  // namespace

Eigen::VectorXd CycleSearch::newton_step() const {
  const auto& free = map_.section().free();
  const auto k = static_cast<Eigen::Index>(free.size());
  if (k == 0) return {};
  const Eigen::MatrixXd P = monodromy();
  const Eigen::VectorXd s = balancing(P);
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(k, k) - s.cwiseInverse().asDiagonal() * P * s.asDiagonal();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const double least = std::max(kSingular, kSingularRuns * map_.problem().solver.rtol);
  if (svd.singularValues()[k - 1] < least * std::max(1.0, svd.singularValues()[0])) {
    Eigen::Index most = 0;
    svd.matrixV().col(k - 1).cwiseProduct(s).cwiseAbs().maxCoeff(&most);
    const SectionCoordinate& c =
        map_.section().coordinates()[static_cast<std::size_t>(free[static_cast<std::size_t>(most)])];
    const double rtol = map_.problem().solver.rtol;
    throw SolverError(fmt::format(
        "A cycle is not determined: a change of '{}' stays as it is from one section to the next (a multiplier is "
        "1{}). Where the mechanism moves on along its way, name that coordinate as 'travel' in [cycle]; where energy "
        "is kept, cycles come in families, and none of them is the limit of anything; at a resonance nothing ends "
        "their "
        "growth.",
        c.name, least > kSingular ? fmt::format(", to what rtol {:g} tells; a smaller one tells more", rtol) : ""));
  }
  const Eigen::VectorXd back = (value.next - x)(free);
  return s.cwiseProduct(svd.solve(back.cwiseQuotient(s)));
}

void CycleSearch::fail(const std::string& why) const {
  throw SolverError(
      fmt::format("No cycle was found: {} After {} iteration{} the return is off by {:.3g} tolerances (rtol {:g}), "
                  "most of all '{}': "
                  "{:.9g} where it began, {:.9g} on return. Begin nearer to the cycle (a start in the gait, 'settle' "
                  "in [cycle] goes "
                  "through some cycles first), or look whether there is one at these parameters.",
                  why, iterations, iterations == 1 ? "" : "s", residual, map_.problem().solver.rtol, worst, entry(x),
                  entry(value.next)));
}

void CycleSearch::solve() {
  const auto& free = map_.section().free();
  std::string refused;
  left.setZero(x.size());
  const auto leave = [&](const Eigen::VectorXd& dx) {
    const Eigen::VectorXd parts = in_tolerances(dx);
    for (std::size_t i = 0; i < free.size(); ++i)
      if (const auto k = static_cast<Eigen::Index>(i); parts[k] > kNear) left[free[i]] = dx[k];
  };
  for (int step = 0; step < options_.max_iterations; ++step) {
    if (options_.progress) options_.progress(iterations, residual);
    check_stop();
    // Also of what closes at once, as all that keeps its energy does.
    const Eigen::VectorXd dx = newton_step();
    if (residual <= 1 && (dx.size() == 0 || in_tolerances(dx).maxCoeff() <= kNear)) return;
    const Eigen::VectorXd from = x;
    const std::vector<double> from_positions = positions;
    const MapValue before = value;
    const double before_residual = residual;
    const std::string before_worst = worst;
    bool better = false;
    double part = 1;
    for (int k = 0; k < kHalvings && !better; ++k, part /= 2) {
      x = from;
      for (std::size_t i = 0; i < free.size(); ++i) x[free[i]] += part * dx[static_cast<Eigen::Index>(i)];
      try {
        // First guesses of what x leaves open: where the last cycle ended, which is nearest to the new start.
        positions = before.positions;
        map_.onto_section(x, positions);
        look(x, positions);
        better = residual < before_residual;
      } catch (const SolverError& e) {
        refused = e.what();
      } catch (const ModelError& e) {
        refused = e.bare_message();
      }
      // Where only the errors of the runs are left, halving does not help.
      if (!better && before_residual <= options_.accepted) break;
    }
    ++iterations;
    if (better && residual > 0.5 * before_residual && residual <= options_.accepted) return leave(newton_step());
    if (better) continue;
    x = from;
    positions = from_positions;
    value = before;
    residual = before_residual;
    worst = before_worst;
    if (residual <= options_.accepted) return leave(dx);
    fail(refused.empty() ? "Newton's steps no longer bring the return nearer." : refused);
  }
  if (residual > options_.accepted) fail(fmt::format("{} iterations were not enough.", options_.max_iterations));
}

}  // namespace costate
