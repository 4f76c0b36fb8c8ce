#include "costate/optimize/active_rows.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace costate {

namespace {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of a candidate's distance: what is at its bound. And of the largest slope, by how much less may be left with others.
constexpr double kAtBound = 1e-4, kAsGood = 1e-4;

using Held = std::function<bool(int j, double s)>;

/// The least |dL/dx|, those whose mu would be negative left out.
ActiveRows among(std::vector<std::size_t> near, const std::vector<CertificateTerms::Row>& rows, const VectorXd& g,
                 const Held& held) {
  const auto n = static_cast<int>(g.size());
  ActiveRows r;
  r.slope = g;
  const int turns = 2 * (n + static_cast<int>(near.size()));
  for (int turn = 0; turn < turns && !near.empty(); ++turn) {
    r.A.resize(n, static_cast<Index>(near.size()));
    for (std::size_t i = 0; i < near.size(); ++i) r.A.col(static_cast<Index>(i)) = rows[near[i]].g;
    // Bounds take what pushes out of them; the rest is to vanish.
    MatrixXd free = r.A;
    VectorXd right = -g;
    for (int j = 0; j < n; ++j)
      if (held(j, r.slope[j])) {
        free.row(j).setZero();
        right[j] = 0;
      }
    r.mu = free.completeOrthogonalDecomposition().solve(right);
    Index worst = 0;
    if (r.mu.minCoeff(&worst) < 0) {
      near.erase(near.begin() + worst);
      r.slope = g;
      continue;
    }
    const VectorXd next = g + r.A * r.mu;
    bool same = true;
    for (int j = 0; j < n; ++j) same = same && held(j, next[j]) == held(j, r.slope[j]);
    r.slope = next;
    if (!same) continue;
    r.near = std::move(near);
    return r;
  }
  // None, or no choice of them settles.
  r.A.resize(n, 0);
  r.mu.resize(0);
  r.slope = g;
  return r;
}

double left(const ActiveRows& r, const Held& held) {
  double most = 0;
  for (Index j = 0; j < r.slope.size(); ++j)
    if (!held(static_cast<int>(j), r.slope[j])) most = std::max(most, std::abs(r.slope[j]));
  return most;
}
}  // namespace

VectorXd valley(const MatrixXd& H, int j, const std::vector<Index>& free) {
  VectorXd u = VectorXd::Unit(H.rows(), j);
  if (free.empty()) return u;
  const Eigen::LDLT<MatrixXd> solver(H(free, free));
  if (solver.info() == Eigen::Success && solver.isPositive()) u(free) = -solver.solve(H(free, j));
  return u.normalized();
}

ActiveRows find_active_rows(const std::vector<CertificateTerms::Row>& rows, const VectorXd& g, const Held& held,
                            double near_bound) {
  const auto within = [&](double part) {
    std::vector<std::size_t> near;
    for (std::size_t c = 0; c < rows.size(); ++c)
      if (rows[c].value >= -part * near_bound * rows[c].size) near.push_back(c);
    return near;
  };
  const std::vector<std::size_t> near = within(1), at = within(kAtBound);
  ActiveRows all = among(near, rows, g, held);
  if (at.size() == near.size() || g.size() == 0) return all;
  ActiveRows alone = among(at, rows, g, held);
  return left(alone, held) <= left(all, held) + kAsGood * g.cwiseAbs().maxCoeff() ? alone : all;
}

}  // namespace costate
