// Bends of forces under second derivatives: lib/README.md (13.13).
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "costate/adjoint/hessian_equations.h"
#include "costate/base/error.h"

namespace costate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Of the largest: what jumps.
constexpr double kJumpOf = 1e-6;
/// Of what it would be if the terms of a sum did not cancel: what is zero.
constexpr double kNothing = 1e-7;
/// Of the clearest row, whatever the units.
constexpr double kRounding = 1e-9;
/// Of its rate: by how much a cost's may jump and yet be no bend.
constexpr double kCost = 1e-5;
/// Of the largest: what the parts of a jump of rank one may differ by.
constexpr double kRankOne = 1e-4;

PathDual line(double x, double dx) { return PathDual(Taylor2(x, dx, 0)); }

/// A force on one side of a bend: (Q, zdot), its rate along the motion, its changes along directions, and its
/// derivatives by q, v, z and the numbers that parameters act on.
class ForceSide {
 public:
  ForceSide(const Force& e, int z0, const Assembly& assembly, const StateView& s)
      : e_(e),
        z0_(z0),
        assembly_(assembly),
        s_(s),
        n_(e.coordinates().size()),
        nz_(static_cast<std::size_t>(e.states())) {
    for (std::size_t i = 0; i < e.numbers().size(); ++i)
      if (!assembly.number_columns()[static_cast<std::size_t>(e.numbers()[i])].empty()) active_.push_back(i);
    p_.resize(e.numbers().size() + 1);
  }

  std::size_t rows() const { return n_ + nz_; }
  VectorXd value() {
    load(0, nullptr, nullptr, nullptr, nullptr);
    return part([](const PathDual& x) { return x.v.c0; });
  }
  VectorXd rate() {
    load(1, s_.v, s_.a, assembly_.zdot.data(), nullptr);
    return part([](const PathDual& x) { return x.v.c1; });
  }
  VectorXd along(const Variation& d) {
    load(0, d.q, d.v, d.z, d.numbers);
    return part([](const PathDual& x) { return x.v.c1; });
  }
  MatrixXd derivatives() {
    load(0, nullptr, nullptr, nullptr, nullptr);
    MatrixXd D(static_cast<Index>(rows()), static_cast<Index>(2 * n_ + nz_ + active_.size()));
    Index column = 0;
    const auto seed = [&](PathDual& x) {
      x.d[0] = Taylor2(1.0);
      D.col(column++) = part([](const PathDual& y) { return y.d[0].c0; });
      x.d[0] = Taylor2(0.0);
    };
    for (std::size_t i = 0; i < n_; ++i) seed(q_[i]);
    for (std::size_t i = 0; i < n_; ++i) seed(v_[i]);
    for (std::size_t i = 0; i < nz_; ++i) seed(z_[i]);
    for (const std::size_t k : active_) seed(p_[k]);
    return D;
  }
  /// Of the columns of derivatives(): those of x (q, v, z of the mechanism), and of the numbers.
  VectorXd gathered(const double* q, const double* v, const double* z, const double* numbers) const {
    VectorXd x(static_cast<Index>(2 * n_ + nz_ + active_.size()));
    Index k = 0;
    for (const int c : e_.coordinates()) x[k++] = q[c];
    for (const int c : e_.coordinates()) x[k++] = v[c];
    for (std::size_t i = 0; i < nz_; ++i) x[k++] = z[static_cast<std::size_t>(z0_) + i];
    for (const std::size_t i : active_) x[k++] = numbers ? numbers[e_.numbers()[i]] : 0;
    return x;
  }
  /// x of gathered() added to where it came from, n + n + nz entries, and to what parameters make of the numbers.
  void scatter(const VectorXd& x, double factor, double* q, double* v, double* z, double* rho) const {
    Index k = 0;
    for (const int c : e_.coordinates()) q[c] += factor * x[k++];
    for (const int c : e_.coordinates()) v[c] += factor * x[k++];
    for (std::size_t i = 0; i < nz_; ++i) z[static_cast<std::size_t>(z0_) + i] += factor * x[k++];
    for (const std::size_t i : active_) {
      for (const auto& [column, c] : assembly_.number_columns()[static_cast<std::size_t>(e_.numbers()[i])])
        rho[column] += factor * c * x[k];
      ++k;
    }
  }
  /// (s1, mu_z) of what the rows are weighted by.
  VectorXd weights(const double* s1, const double* mu_z) const {
    VectorXd w(static_cast<Index>(rows()));
    Index k = 0;
    for (const int c : e_.coordinates()) w[k++] = s1[c];
    for (std::size_t i = 0; i < nz_; ++i) w[k++] = mu_z[static_cast<std::size_t>(z0_) + i];
    return w;
  }

 private:
  void load(double dt, const double* dq, const double* dv, const double* dz, const double* dp) {
    t_ = line(s_.t, dt);
    const auto& c = e_.coordinates();
    for (std::size_t i = 0; i < n_; ++i) {
      q_[i] = line(s_.q[c[i]], dq ? dq[c[i]] : 0);
      v_[i] = line(s_.v[c[i]], dv ? dv[c[i]] : 0);
    }
    for (std::size_t i = 0; i < nz_; ++i) {
      const auto k = static_cast<std::size_t>(z0_) + i;
      z_[i] = line(s_.z[k], dz ? dz[k] : 0);
    }
    for (std::size_t i = 0; i < e_.numbers().size(); ++i) {
      const auto k = static_cast<std::size_t>(e_.numbers()[i]);
      p_[i] = line(assembly_.numbers()[k], dp ? dp[k] : 0);
    }
  }
  template <class Part>
  VectorXd part(const Part& of) {
    std::fill(Q_.begin(), Q_.end(), PathDual());
    std::fill(f_.begin(), f_.end(), PathDual());
    e_.force(t_, q_.data(), v_.data(), z_.data(), p_.data(), Q_.data(), f_.data());
    VectorXd x(static_cast<Index>(rows()));
    for (std::size_t i = 0; i < n_; ++i) x[static_cast<Index>(i)] = of(Q_[i]);
    for (std::size_t i = 0; i < nz_; ++i) x[static_cast<Index>(n_ + i)] = of(f_[i]);
    return x;
  }

  const Force& e_;
  int z0_;
  const Assembly& assembly_;
  StateView s_;
  std::size_t n_, nz_;
  std::vector<std::size_t> active_;
  PathDual t_;
  std::array<PathDual, kMaxLocal> q_, v_, z_, Q_, f_;
  std::vector<PathDual> p_;
};

/// By columns, whose units differ; of the largest entry of all what is rounding.
bool differ(const MatrixXd& a, const MatrixXd& b) {
  const double noise = 1e-3 * kJumpOf * std::max(a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff());
  for (Index j = 0; j < a.cols(); ++j) {
    const double size = std::max(a.col(j).cwiseAbs().maxCoeff(), b.col(j).cwiseAbs().maxCoeff());
    if ((a.col(j) - b.col(j)).cwiseAbs().maxCoeff() > kJumpOf * size + noise) return true;
  }
  return false;
}

VectorXd joined(const ScalarGradient& g) {
  VectorXd x(g.q.size() + g.v.size() + g.a.size() + g.lambda.size() + g.z.size() + g.rho.size());
  x << g.q, g.v, g.a, g.lambda, g.z, g.rho;
  return x;
}

[[noreturn]] void refuse(double t, const std::string& what) {
  throw CapabilityError(fmt::format(
      "At t = {:.6g} s {}: second derivatives are not carried across. Differences of gradients tell them.", t, what));
}

}  // namespace

void HessianEquations::append_blocks(double t, const double* y, std::vector<double>& values,
                                     std::vector<std::size_t>& ends) {
  const std::vector<double> rest(static_cast<std::size_t>(std::max(n_, m_)), 0.0);
  StateView s;
  s.t = t;
  s.q = y;
  s.v = y + n_;
  s.z = y + 2 * n_;
  s.a = s.lambda = rest.data();
  const auto add = [&](const double* x, std::size_t count) {
    values.insert(values.end(), x, x + count);
    ends.push_back(values.size());
  };
  // Forces alone: accelerations may jump where a driver's do, at its own time.
  assembly_.calc_partials(s);
  for (const auto* block : {&assembly_.K, &assembly_.C, &assembly_.Q_z, &assembly_.f_q, &assembly_.f_v, &assembly_.f_z})
    add(block->data(), block->size());
  assembly_.calc_parameter_columns(s, columns_);
  for (const auto* block : {&columns_.F, &columns_.f}) add(block->data(), static_cast<std::size_t>(block->size()));
  if (objective_.running.empty()) return;
  if (objective_.running_needs_accelerations()) {
    level_.solve(s);
    s = level_.state();
  }
  gradient_.set_zero();
  objective_.add_running_gradient(s, assembly_, gradient_);
  for (const auto* block : {&gradient_.q, &gradient_.v, &gradient_.a, &gradient_.lambda, &gradient_.z, &gradient_.rho})
    add(block->data(), static_cast<std::size_t>(block->size()));
}

void HessianEquations::follow_bend(Bend& bend, const Sizes& sizes) {
  const int N = state_size();
  bend.moved.clear();
  const auto& forces = assembly_.mechanism().forces();
  struct OfForce {
    VectorXd value, rate;
    MatrixXd along, derivatives;
  };
  std::array<std::vector<OfForce>, 2> sides;
  std::array<VectorXd, 2> a, cost;
  VectorXd cost_sizes;
  std::vector<MatrixXd> terms(forces.size());  // of each force, the largest of x' and of its changes
  for (const int side : {0, 1}) {
    const std::vector<double>& y = side == 0 ? bend.state_before : bend.state_after;
    evaluate(side == 0 ? bend.before : bend.after, y.data(), y.data() + N);
    const StateView s = level_.state();
    a[static_cast<std::size_t>(side)] = Eigen::Map<const VectorXd>(s.a, n_);
    gradient_.set_zero();
    objective_.add_running_gradient(s, assembly_, gradient_);
    cost[static_cast<std::size_t>(side)] = joined(gradient_);
    ScalarGradient of_cost = gradient_;
    of_cost.q = sizes.columns.col(0).head(n_);
    of_cost.v = of_cost.a = sizes.columns.col(0).segment(n_, n_);
    of_cost.z = sizes.columns.col(0).tail(nz_);
    of_cost.lambda = Eigen::Map<const VectorXd>(s.lambda, m_).cwiseAbs();
    for (int j = 0; j < parameter_count(); ++j)
      of_cost.rho[j] = assembly_.parameters().parameters[static_cast<std::size_t>(j)].scale;
    cost_sizes = joined(of_cost);
    for (std::size_t k = 0; k < forces.size(); ++k) {
      ForceSide force(*forces[k], assembly_.mechanism().state_offsets()[k], assembly_, s);
      OfForce& f = sides[static_cast<std::size_t>(side)].emplace_back();
      f.value = force.value();
      f.rate = force.rate();
      f.derivatives = force.derivatives();
      f.along.resize(static_cast<Index>(force.rows()), directions());
      for (int j = 0; j < directions(); ++j) f.along.col(j) = force.along(variation(j));
      MatrixXd x(f.derivatives.cols(), 1 + directions());
      for (int j = 0; j <= directions(); ++j) {
        const double* size = sizes.columns.col(j).data();
        x.col(j) = force.gathered(size, size + n_, size + 2 * n_,
                                  j > 0 ? number_changes_[static_cast<std::size_t>(j - 1)].data() : nullptr);
      }
      terms[k] = x.cwiseAbs();
    }
  }
  const VectorXd largest_a = sizes.columns.col(0).segment(n_, n_);
  const bool jerks = ((a[1] - a[0]).cwiseAbs() - 10 * kJumpOf * largest_a).maxCoeff() > 1e-9 * largest_a.maxCoeff();
  // At a time of its own, which nothing moves.
  const auto jumps = [&](std::size_t k) {
    const OfForce &f = sides[0][k], &g = sides[1][k];
    const VectorXd allowed = kJumpOf * sizes.span * (f.derivatives.cwiseAbs() * terms[k].col(0)) +
                             1e-3 * kJumpOf * f.value.cwiseAbs() +
                             2 * (bend.after - bend.before) * (f.rate.cwiseAbs() + g.rate.cwiseAbs());
    return ((g.value - f.value).cwiseAbs() - allowed).maxCoeff() > 0;
  };
  for (std::size_t k = 0; k < forces.size(); ++k) {
    const OfForce &f = sides[0][k], &g = sides[1][k];
    if (f.derivatives.size() == 0 || !differ(f.derivatives, g.derivatives) || jumps(k)) continue;
    const std::string name = forces[k]->path();
    if (jerks) refuse(bend.before, fmt::format("'{}' bends where accelerations jump", name));
    const MatrixXd D = (g.derivatives - f.derivatives).cwiseAbs() * terms[k];
    VectorXd moved = VectorXd::Zero(directions());
    const MatrixXd along = g.along - f.along;
    const VectorXd rate = g.rate - f.rate;
    bool moves = false;
    for (Index j = 0; j < moved.size(); ++j)
      moves = moves || (along.col(j).cwiseAbs() - kNothing * D.col(j + 1)).maxCoeff() > 0;
    if (moves) {
      // The row whose jump is the clearest.
      Index row = 0;
      (rate.cwiseAbs().array() / (f.rate.cwiseAbs() + g.rate.cwiseAbs()).array().max(1e-300)).maxCoeff(&row);
      if (!(std::abs(rate[row]) > kNothing * D(row, 0)))
        refuse(bend.before, fmt::format("'{}' grazes a place where its derivative jumps", name));
      moved = -along.row(row).transpose() / rate[row];
      // What is smooth changes a little as well, and what is rounding is of no rank.
      for (Index i = 0; i < rate.size(); ++i)
        for (Index j = 0; j < moved.size(); ++j) {
          if (D(i, 0) <= kRounding * D.col(0).maxCoeff()) continue;
          const double smooth = kJumpOf * (std::abs(f.along(i, j)) + std::abs(g.along(i, j)) +
                                           (std::abs(f.rate[i]) + std::abs(g.rate[i])) * std::abs(moved[j]));
          if (std::abs(along(i, j) + rate[i] * moved[j]) >
              kRankOne * std::max(std::abs(along(i, j)), std::abs(rate[i] * moved[j])) + kNothing * D(i, j + 1) +
                  smooth)
            refuse(bend.before, fmt::format("'{}' passes several places at once where its derivatives jump", name));
        }
    }
    bend.moved.emplace_back(k, std::move(moved));
  }
  if (!bend.moved.empty() || jerks || objective_.running.empty()) return;
  for (std::size_t k = 0; k < forces.size(); ++k)
    if (sides[0][k].value.size() > 0 && jumps(k)) return;
  // What the cost's rate jumps by, were nothing to cancel, against the whole.
  const VectorXd jump = ((cost[1] - cost[0]).cwiseAbs()).cwiseProduct(cost_sizes),
                 whole = (cost[0].cwiseAbs() + cost[1].cwiseAbs()).cwiseProduct(cost_sizes);
  const Index np = parameter_count(), states = jump.size() - np;
  if (jump.head(states).sum() > kCost * whole.head(states).sum() || jump.tail(np).sum() > kCost * whole.tail(np).sum())
    refuse(bend.before, "the derivative of the running cost jumps");
}

void HessianEquations::cross_bend(const Bend& bend, const double* mu, double* dmu, double* products) {
  const int N = state_size(), np = parameter_count(), count = directions();
  // Rates of (mu, the gradient's integral) on both sides, at one and the same mu; and forces' derivatives there.
  std::array<VectorXd, 2> rates;
  std::array<std::vector<MatrixXd>, 2> derivatives;
  VectorXd s, x(N + np), dmup(static_cast<Index>(N) * count), dintegrand(static_cast<Index>(np) * count);
  const auto& forces = assembly_.mechanism().forces();
  const auto side_of = [&](std::size_t k) {
    return ForceSide(*forces[k], assembly_.mechanism().state_offsets()[k], assembly_, level_.state());
  };
  for (const std::size_t side : {0, 1}) {
    const std::vector<double>& y = side == 0 ? bend.state_before : bend.state_after;
    evaluate(side == 0 ? bend.before : bend.after, y.data(), y.data() + N);
    x.setZero();
    adjoint(mu, dmu, x.data(), dmup.data(), x.data() + N, dintegrand.data());
    rates[side] = x;
    s = Eigen::Map<const VectorXd>(s_.data(), n_ + m_);
    for (const auto& [k, moved] : bend.moved) derivatives[side].push_back(side_of(k).derivatives());
  }
  VectorXd jump = rates[1] - rates[0];
  const double size = std::max(rates[0].cwiseAbs().maxCoeff(), rates[1].cwiseAbs().maxCoeff());
  // x of rates: mu' loses what L_x gains.
  const auto cross = [&](const VectorXd& by, const VectorXd& moved) {
    for (Index j = 0; j < count; ++j) {
      Eigen::Map<VectorXd>(dmu + j * N, N) += moved[j] * by.head(N);
      Eigen::Map<VectorXd>(products + j * np, np) -= moved[j] * by.tail(np);
    }
  };
  bool together = true;
  for (const auto& [k, moved] : bend.moved) {
    const VectorXd& first = bend.moved.front().second;
    together = together && (moved - first).cwiseAbs().maxCoeff() <= kJumpOf * first.cwiseAbs().maxCoeff();
  }
  if (together) {
    if (!bend.moved.empty()) cross(jump, bend.moved.front().second);
    return;
  }
  for (std::size_t i = 0; i < bend.moved.size(); ++i) {
    const auto& [k, moved] = bend.moved[i];
    const ForceSide force = side_of(k);
    const VectorXd L = (derivatives[1][i] - derivatives[0][i]).transpose() * force.weights(s.data(), mu + 2 * n_);
    VectorXd own = VectorXd::Zero(N + np);
    VectorXd rho = VectorXd::Zero(np);
    force.scatter(L, -1, own.data(), own.data() + n_, own.data() + 2 * n_, rho.data());
    own.tail(np) = -rho;
    cross(own, moved);
    jump -= own;
  }
  if (jump.cwiseAbs().maxCoeff() > kRankOne * size)
    refuse(bend.before, "several forces bend, and the running cost with them");
}

}  // namespace costate
