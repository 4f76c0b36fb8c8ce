// A second-order cone program of few unknowns: along its central path by Newton's method on the barrier
//   -s/tau - sum log((mu N - s)^2 - |T|^2),   without friction -log(N - s).
#include "costate/event/resting_shares.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

namespace {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// In units of the largest force: the path's first and last tau, by how much it falls, and where weights are known best,
// between their error, tau, and rounding, which is that of 1/tau.
constexpr double kFirst = 1, kLast = 2e-13, kFalls = 0.2, kOfWeights = 1e-8;
constexpr int kMostSteps = 60;
// Newton's decrement, squared, at which a point is central.
constexpr double kCentral = 1e-10;
// Shares this many times the load are held by what presses contacts against each other.
constexpr double kWithoutLimit = 1e6;

/// The barrier at (xi, s): its value, or infinity outside; gradient and second derivatives on demand.
class ConeBarrier {
 public:
  ConeBarrier(const std::vector<RestingCone>& cones, VectorXd forces, const MatrixXd& Z)
      : cones_(cones), forces_(std::move(forces)), Z_(Z) {}

  VectorXd shares(const VectorXd& x) const { return forces_ + Z_ * x.head(Z_.cols()); }

  double value(const VectorXd& x) const {
    const VectorXd f = shares(x);
    double sum = 0;
    for (const RestingCone& c : cones_) {
      const double u = normal(c, f, x), d = c.count > 1 ? product(c, f, u) : u;
      if (!(u > 0) || !(d > 0)) return std::numeric_limits<double>::infinity();
      sum -= std::log(d);
    }
    return sum;
  }

  void derivatives(const VectorXd& x, VectorXd& gradient, MatrixXd& second) const {
    const VectorXd f = shares(x);
    const Index k = Z_.cols();
    gradient = VectorXd::Zero(k + 1);
    second = MatrixXd::Zero(k + 1, k + 1);
    VectorXd by_u(k + 1);
    for (const RestingCone& c : cones_) {
      const double u = normal(c, f, x);
      by_u << (c.count > 1 ? c.friction : 1) * Z_.row(c.first).transpose(), -1;
      if (c.count == 1) {
        gradient -= by_u / u;
        second += by_u * by_u.transpose() / (u * u);
        continue;
      }
      const double d = product(c, f, u);
      VectorXd by_d = 2 * u * by_u;
      MatrixXd of_d = 2 * by_u * by_u.transpose();
      for (int r = 1; r < c.count; ++r) {
        VectorXd by_t = VectorXd::Zero(k + 1);
        by_t.head(k) = Z_.row(c.first + r).transpose();
        by_d -= 2 * f[c.first + r] * by_t;
        of_d -= 2 * by_t * by_t.transpose();
      }
      gradient -= by_d / d;
      second += by_d * by_d.transpose() / (d * d) - of_d / d;
    }
  }

  /// tau times the barrier's derivatives by forces, and by s.
  void duals(const VectorXd& x, double tau, VectorXd& weights, VectorXd& at_limit) const {
    const VectorXd f = shares(x);
    weights = VectorXd::Zero(f.size());
    at_limit = VectorXd::Zero(static_cast<Index>(cones_.size()));
    for (std::size_t i = 0; i < cones_.size(); ++i) {
      const RestingCone& c = cones_[i];
      const double u = normal(c, f, x);
      const double w = c.count > 1 ? 2 * tau * u / product(c, f, u) : tau / u;
      at_limit[static_cast<Index>(i)] = w;
      weights[c.first] = w * (c.count > 1 ? c.friction : 1);
      for (int r = 1; r < c.count; ++r) weights[c.first + r] = -w * f[c.first + r] / u;
    }
  }

 private:
  static double normal(const RestingCone& c, const VectorXd& f, const VectorXd& x) {
    return (c.count > 1 ? c.friction : 1) * f[c.first] - x[x.size() - 1];
  }
  static double product(const RestingCone& c, const VectorXd& f, double u) {
    const double t = f.segment(c.first + 1, c.count - 1).norm();
    return (u - t) * (u + t);
  }

  const std::vector<RestingCone>& cones_;
  VectorXd forces_;
  const MatrixXd& Z_;
};
}  // namespace

double margin_of(const RestingCone& c, const VectorXd& f) {
  return c.count > 1 ? c.friction * f[c.first] - f.segment(c.first + 1, c.count - 1).norm() : f[c.first];
}

std::optional<RestingShares> best_shares(const std::vector<RestingCone>& cones, const VectorXd& forces,
                                         const MatrixXd& moves_nothing) {
  const Index k = moves_nothing.cols();
  const double size = forces.cwiseAbs().maxCoeff();
  RestingShares best;
  if (!(size > 0)) {
    best.forces = best.weights = VectorXd::Zero(forces.size());
    best.at_limit = VectorXd::Constant(static_cast<Index>(cones.size()), 1.0 / static_cast<double>(cones.size()));
    return best;
  }
  const ConeBarrier barrier(cones, forces / size, moves_nothing);
  VectorXd x = VectorXd::Zero(k + 1), gradient;
  x[k] = 1e300;
  for (const RestingCone& c : cones) x[k] = std::min(x[k], margin_of(c, forces / size) - 1);
  MatrixXd second;
  double tau = kFirst, before = x[k];
  for (;; tau *= kFalls) {
    before = x[k];
    for (int i = 0; i < kMostSteps; ++i) {
      barrier.derivatives(x, gradient, second);
      gradient[k] -= 1 / tau;
      const VectorXd step = -second.ldlt().solve(gradient);
      const double decrement = -step.dot(gradient);
      if (!(decrement > kCentral)) break;
      const double here = barrier.value(x) - x[k] / tau;
      double part = 1;
      const auto worse = [&] {
        const VectorXd next = x + part * step;
        return !(barrier.value(next) - next[k] / tau <= here - 0.1 * part * decrement);
      };
      while (part > 1e-12 && worse()) part /= 2;
      if (!(part > 1e-12)) break;  // by rounding
      x += part * step;
      if (x.cwiseAbs().maxCoeff() > kWithoutLimit) return std::nullopt;
    }
    if (!(tau < kOfWeights) || best.weights.size() == 0) barrier.duals(x, tau, best.weights, best.at_limit);
    if (tau < kLast) break;
  }
  // s falls short of h by a multiple of tau, to first order.
  best.margin = size * (x[k] + (x[k] - before) * kFalls / (1 - kFalls));
  best.forces = size * barrier.shares(x);
  return best;
}

}  // namespace costate
