#include "costate/analysis/closing_path.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/analysis/given_system.h"
#include "costate/analysis/mechanism_size.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/base/stop.h"
#include "costate/linear/to_dense.h"

namespace costate {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr double kLongestPathMove = 0.2;  // of the mechanism's extent
constexpr double kLongestPathTurn = 0.3;  // also of Euler parameters and other coordinates of size 1
constexpr double kContraction = 0.25;
constexpr double kOnPath = 0.02;        // a correction this small, in step lengths, is near enough
constexpr double kShortestPart = 1e-6;  // of the path
constexpr int kMostParts = 2000;
constexpr int kDescents = 300;
constexpr int kDensePathLimit = 500;
}  // namespace

StepLength::StepLength(const Assembly& assembly, const VectorXd& q) : weight_(assembly.n()) {
  const double extent = extent_of(assembly, q).value_or(1);
  for (int i = 0; i < assembly.n(); ++i)
    weight_[i] =
        1 / (assembly.mechanism().coordinates()[static_cast<std::size_t>(i)].unit == "m" ? kLongestPathMove * extent
                                                                                         : kLongestPathTurn);
}

ClosingPath::ClosingPath(Assembly& assembly, double t, const std::vector<GivenStart>& given, VectorXd z0)
    : assembly_(assembly), t_(t), given_(given), z0_(std::move(z0)) {}

VectorXd ClosingPath::residual(const VectorXd& q) {
  StateView s;
  s.t = t_;
  s.q = q.data();
  assembly_.calc_constraints(s);
  const int rows = assembly_.m();
  VectorXd r(rows + z0_.size());
  for (int i = 0; i < rows; ++i) r[i] = assembly_.phi[static_cast<std::size_t>(i)];
  for (const int i : rows_without_place(assembly_)) r[i] = 0;
  for (Eigen::Index g = 0; g < z0_.size(); ++g)
    r[rows + g] = q[given_[static_cast<std::size_t>(g)].coordinate] - z0_[g];
  return r;
}

bool ClosingPath::follow(VectorXd& q) {
  const StepLength length(assembly_, q);
  GivenSystem system(assembly_, given_, GivenSystem::Of::positions);
  const VectorXd r0 = residual(q);
  VectorXd r = r0;
  double s = 0, part = 1;
  for (int k = 0; k < kMostParts; ++k) {
    check_stop();
    if (s >= 1) return true;
    system.factor(q.data());
    // Newton's step onto r = (1 - s) r0 falls by the part, but for what is left of the last correction.
    for (;; part /= 2) {
      if (part < kShortestPart) return false;
      const double left = std::max(0.0, 1 - s - part);
      const VectorXd first = system.solve(left * r0 - r);
      if (!first.allFinite()) return false;
      const double longest = length(first);
      if (longest > 1) continue;
      VectorXd at = q + first, there = residual(at);
      // With the same matrix, as the natural test of Newton's iteration has it.
      const VectorXd second = system.solve(left * r0 - there);
      const double next = second.allFinite() ? length(second) : HUGE_VAL;
      if (!(next <= kContraction * longest || next <= 1e-9)) continue;
      if (next > kOnPath) {
        at += second;
        there = residual(at);
        if (!(length(system.solve(left * r0 - there)) <= kContraction * next)) continue;
      }
      q = at;
      r = there;
      s = 1 - left;
      part = std::min(next <= 0.05 * longest ? 2 * part : part, std::max(1 - s, kShortestPart));
      break;
    }
  }
  return false;
}

bool ClosingPath::descend(VectorXd& q) {
  const int n = assembly_.n();
  if (n > kDensePathLimit) return false;
  const StepLength length(assembly_, q);
  const VectorXd w = length.weights();
  VectorXd r = residual(q), row;
  double mu = 1e-3;
  for (int k = 0; k < kDescents; ++k) {
    check_stop();
    if (!r.allFinite()) return false;
    // In step lengths, with rows of comparable size.
    MatrixXd J = MatrixXd::Zero(r.size(), n);
    J.topRows(assembly_.m()) = to_dense(assembly_.jacobian(), assembly_.phi_q.data());
    for (const int i : rows_without_place(assembly_)) J.row(i).setZero();
    for (std::size_t g = 0; g < given_.size(); ++g)
      J(assembly_.m() + static_cast<Eigen::Index>(g), given_[g].coordinate) = 1;
    J *= w.cwiseInverse().asDiagonal();
    if (row.size() == 0) {
      row = J.rowwise().norm();
      for (double& x : row) x = x > 0 ? 1 / x : 1;
    }
    J = row.asDiagonal() * J;
    const VectorXd b = row.cwiseProduct(r);
    if (b.size() == 0 || b.norm() < 1e-6) return true;
    bool moved = false;
    for (int trial = 0; trial < 40 && !moved; ++trial) {
      const VectorXd step = w.cwiseInverse().asDiagonal() *
                            (J.transpose() * J + mu * MatrixXd::Identity(n, n)).ldlt().solve(J.transpose() * -b);
      const double longest = length(step);
      if (longest <= 1) {
        const VectorXd at = q + step, there = residual(at);
        if (there.allFinite() && row.cwiseProduct(there).norm() < b.norm()) {
          moved = true;
          if (longest < 1e-10) return false;  // settled with gaps
          q = at;
          r = there;
          mu = std::max(1e-12, mu / 4);
          continue;
        }
      }
      mu = std::max(1e-12, mu) * 4;
    }
    if (!moved) return false;
  }
  return false;
}

}  // namespace costate
