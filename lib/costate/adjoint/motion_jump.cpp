#include "costate/adjoint/motion_jump.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Of their times: events this near are at one instant, as nothing else happens between them.
constexpr double kOneInstant = 8 * std::numeric_limits<double>::epsilon();
// Of the span: steps below this are lost in rounding.
constexpr double kLost = 1e-12;
}  // namespace

void StretchMap::push(Eigen::MatrixXd& dx, Eigen::VectorXd& gradient) const {
  const Eigen::Index np = X.cols() - size();
  gradient += c.tail(np) + dx.transpose() * c.head(size());
  dx = X.leftCols(size()) * dx + X.rightCols(np);
}

void StretchMap::pull(double* w, double* gradient) const {
  const Eigen::Index np = X.cols() - size();
  Eigen::Map<Eigen::VectorXd> weights(w, size());
  const Eigen::VectorXd pulled = X.transpose() * weights + c;
  weights = pulled.head(size());
  Eigen::Map<Eigen::VectorXd>(gradient, np) += pulled.tail(np);
}

std::vector<MotionJump> motion_jumps(const std::vector<double>& times, const std::vector<MetEvent>& events) {
  std::vector<MotionJump> all;
  for (const double t : times) all.push_back({std::nextafter(t, -kInfinity), t, {}});
  for (const MetEvent& e : events) {
    if (!all.empty() && !all.back().events.empty() &&
        e.t - all.back().before <= kOneInstant * std::max(1.0, std::abs(e.t))) {
      all.back().after = std::max(all.back().after, std::nextafter(e.t, kInfinity));
      all.back().events.push_back(e);
      continue;
    }
    all.push_back({e.t, std::nextafter(e.t, kInfinity), {e}});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const MotionJump& a, const MotionJump& b) { return a.before < b.before; });
  return all;
}

std::vector<double> outside_stretches(std::vector<double> grid, const std::vector<MotionJump>& jumps) {
  std::erase_if(grid, [&](double t) {
    return std::any_of(jumps.begin(), jumps.end(),
                       [&](const MotionJump& j) { return j.map && j.before < t && t < j.after; });
  });
  return grid;
}

std::vector<double> with_jumps(const std::vector<double>& grid, const std::vector<MotionJump>& jumps) {
  if (jumps.empty()) return grid;
  const double near = kLost * (grid.back() - grid.front());
  std::vector<double> r;
  for (const double t : grid) {
    const bool lost = std::any_of(jumps.begin(), jumps.end(), [&](const MotionJump& j) {
      return std::abs(t - j.before) < near || (j.map && j.before < t && t - j.after < near);
    });
    if (t == grid.front() || t == grid.back() || !lost) r.push_back(t);
  }
  for (const MotionJump& j : jumps) {
    r.push_back(j.before);
    if (j.map && j.after < grid.back()) r.push_back(j.after);
  }
  std::sort(r.begin(), r.end());
  r.erase(std::unique(r.begin(), r.end()), r.end());
  return r;
}

}  // namespace costate
