// Bends of forces under second derivatives: lib/README.md (13.13).
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "costate/adjoint/hessian_equations.h"
#include "costate/adjoint/steep_begins.h"
#include "costate/assembly/packed_state.h"
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

/// What a force depends on: its coordinates, their velocities, its states and the numbers that parameters act on, in
/// this order.
class ForceArguments {
 public:
  ForceArguments(const Force& force, int z0, const Assembly& assembly)
      : force_(force), z0_(z0), assembly_(assembly), k_(static_cast<Index>(force.coordinates().size())) {
    for (std::size_t i = 0; i < force.numbers().size(); ++i)
      if (!columns_of(i).empty()) active_.push_back(static_cast<int>(i));
  }

  const Force& force() const { return force_; }
  /// Local, of force().numbers().
  const std::vector<int>& active_numbers() const { return active_; }
  Index size() const { return 2 * k_ + force_.states() + static_cast<Index>(active_.size()); }

  /// Of the whole mechanism's; `numbers` may be null for zeros.
  VectorXd gathered(const double* q, const double* v, const double* z, const double* numbers) const {
    VectorXd x(size());
    Index i = 0;
    for (const int c : force_.coordinates()) x[i++] = q[c];
    for (const int c : force_.coordinates()) x[i++] = v[c];
    for (int k = 0; k < force_.states(); ++k) x[i++] = z[z0_ + k];
    for (const int k : active_) x[i++] = numbers ? numbers[force_.numbers()[static_cast<std::size_t>(k)]] : 0;
    return x;
  }
  /// x added to where it belongs in (q, v, z, rho) of the whole mechanism.
  void scatter(const VectorXd& x, VectorXd& whole) const {
    const int n = assembly_.n(), nz = assembly_.nz();
    Index i = 0;
    for (const int c : force_.coordinates()) whole[c] += x[i++];
    for (const int c : force_.coordinates()) whole[n + c] += x[i++];
    for (int k = 0; k < force_.states(); ++k) whole[2 * n + z0_ + k] += x[i++];
    for (const int k : active_) {
      for (const auto& [column, c] : columns_of(static_cast<std::size_t>(k))) whole[2 * n + nz + column] += c * x[i];
      ++i;
    }
  }
  /// What (Q, zdot) are weighted by in L.
  VectorXd weights(const double* s1, const double* mu_z) const {
    VectorXd w(k_ + force_.states());
    Index i = 0;
    for (const int c : force_.coordinates()) w[i++] = s1[c];
    for (int k = 0; k < force_.states(); ++k) w[i++] = mu_z[z0_ + k];
    return w;
  }

 private:
  const std::vector<std::pair<int, double>>& columns_of(std::size_t number) const {
    return assembly_.number_columns()[static_cast<std::size_t>(force_.numbers()[number])];
  }

  const Force& force_;
  int z0_;
  const Assembly& assembly_;
  Index k_;
  std::vector<int> active_;
};

/// (Q, zdot) by the force's arguments, at the state.
MatrixXd force_derivatives(const ForceArguments& x, Assembly& assembly, const StateView& s) {
  const Force& e = x.force();
  const auto k = static_cast<Index>(e.coordinates().size()), z = static_cast<Index>(e.states());
  const LocalState at = assembly.gather(e, 0, s);
  std::array<MatrixXd, 6> blocks{MatrixXd::Zero(k, k), MatrixXd::Zero(k, k), MatrixXd::Zero(k, z),
                                 MatrixXd::Zero(z, k), MatrixXd::Zero(z, k), MatrixXd::Zero(z, z)};
  const auto map = [&](std::size_t i) { return LocalMatrix(blocks[i].data(), blocks[i].rows(), blocks[i].cols()); };
  LocalMatrix Q_q = map(0), Q_v = map(1), Q_z = map(2), f_q = map(3), f_v = map(4), f_z = map(5);
  e.calc_partials(at, ForcePartials{Q_q, Q_v, Q_z, f_q, f_v, f_z});
  MatrixXd D = MatrixXd::Zero(k + z, x.size());
  const Index columns[] = {0, k, 2 * k};
  for (std::size_t i = 0; i < 3; ++i) {
    D.block(0, columns[i], k, blocks[i].cols()) = blocks[i];
    D.block(k, columns[i], z, blocks[i].cols()) = blocks[3 + i];
  }
  Index column = 2 * k + z;
  for (const int number : x.active_numbers()) {
    double* of = D.col(column++).data();
    e.calc_number_partial(at, number, of, of + k);
  }
  return D;
}

/// The part of the rate of (Q, zdot) that is of the time itself.
VectorXd explicit_rate(const Force& e, Assembly& assembly, const StateView& s) {
  const LocalState at = assembly.gather(e, 0, s);
  const std::size_t k = e.coordinates().size(), z = static_cast<std::size_t>(e.states());
  std::array<PathDual, kMaxLocal> q, v, states, Q, f;
  std::copy(at.q, at.q + k, q.begin());
  std::copy(at.v, at.v + k, v.begin());
  std::copy(at.z, at.z + z, states.begin());
  const std::vector<PathDual> p(at.p, at.p + e.numbers().size());
  e.force(PathDual(Taylor2(at.t, 1, 0)), q.data(), v.data(), states.data(), p.data(), Q.data(), f.data());
  VectorXd rate(static_cast<Index>(k + z));
  for (std::size_t i = 0; i < k; ++i) rate[static_cast<Index>(i)] = Q[i].v.c1;
  for (std::size_t i = 0; i < z; ++i) rate[static_cast<Index>(k + i)] = f[i].v.c1;
  return rate;
}

/// A force on one side of a bend.
struct ForceSide {
  VectorXd value, rate;         // of (Q, zdot), along the motion
  MatrixXd derivatives, along;  // by its arguments, along directions
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

/// What tells a jump from rounding: the largest (Q, zdot)'s arguments and their changes along directions, as sizes.
struct BendScale {
  double t = 0, apart = 0, span = 0;  // of the two sides
  MatrixXd arguments;                 // a column for x', one a direction
};

/// At a time of its own, which nothing moves.
bool value_jumps(const ForceSide& f, const ForceSide& g, const BendScale& by) {
  if (f.value.size() == 0) return false;
  const VectorXd allowed = kJumpOf * by.span * (f.derivatives.cwiseAbs() * by.arguments.col(0)) +
                           1e-3 * kJumpOf * f.value.cwiseAbs() + 2 * by.apart * (f.rate.cwiseAbs() + g.rate.cwiseAbs());
  return ((g.value - f.value).cwiseAbs() - allowed).maxCoeff() > 0;
}

/// dt along each direction, of the instant at which this force bends: its value is continuous, (13.13).
VectorXd moved_instant(const std::string& name, const ForceSide& f, const ForceSide& g, const BendScale& by) {
  const MatrixXd D = (g.derivatives - f.derivatives).cwiseAbs() * by.arguments, along = g.along - f.along;
  const VectorXd rate = g.rate - f.rate;
  bool moves = false;
  for (Index j = 0; j < along.cols(); ++j)
    moves = moves || (along.col(j).cwiseAbs() - kNothing * D.col(j + 1)).maxCoeff() > 0;
  if (!moves) return VectorXd::Zero(along.cols());
  // The row whose jump is the clearest.
  Index row = 0;
  (rate.cwiseAbs().array() / (f.rate.cwiseAbs() + g.rate.cwiseAbs()).array().max(1e-300)).maxCoeff(&row);
  if (!(std::abs(rate[row]) > kNothing * D(row, 0)))
    refuse(by.t, fmt::format("'{}' grazes a place where its derivative jumps", name));
  const VectorXd moved = -along.row(row).transpose() / rate[row];
  // What is smooth changes a little as well, and what is rounding is of no rank.
  for (Index i = 0; i < rate.size(); ++i)
    for (Index j = 0; j < moved.size(); ++j) {
      if (D(i, 0) <= kRounding * D.col(0).maxCoeff()) continue;
      const double smooth = kJumpOf * (std::abs(f.along(i, j)) + std::abs(g.along(i, j)) +
                                       (std::abs(f.rate[i]) + std::abs(g.rate[i])) * std::abs(moved[j])),
                   allowed = kRankOne * std::max(std::abs(along(i, j)), std::abs(rate[i] * moved[j])) +
                             kNothing * D(i, j + 1) + smooth;
      if (std::abs(along(i, j) + rate[i] * moved[j]) > allowed)
        refuse(by.t, fmt::format("'{}' passes several places at once where its derivatives jump", name));
    }
  return moved;
}

/// `sizes`: of what the cost's derivatives, its last `np` by the parameters, are multiplied by. What its rate jumps by,
/// were nothing to cancel, against the whole.
bool cost_bends(const VectorXd& before, const VectorXd& after, const VectorXd& sizes, Index np) {
  const VectorXd jump = (after - before).cwiseAbs().cwiseProduct(sizes),
                 whole = (before.cwiseAbs() + after.cwiseAbs()).cwiseProduct(sizes);
  const Index states = jump.size() - np;
  return jump.head(states).sum() > kCost * whole.head(states).sum() ||
         jump.tail(np).sum() > kCost * whole.tail(np).sum();
}

}  // namespace

void HessianEquations::append_blocks(double t, const double* y, std::vector<double>& values,
                                     std::vector<std::size_t>& ends) {
  const std::vector<double> rest(static_cast<std::size_t>(std::max(n_, m_)), 0.0);
  StateView s = packed_view(t, y, n_);
  s.a = s.lambda = rest.data();
  const auto add = [&](const double* x, std::size_t count) {
    values.insert(values.end(), x, x + count);
    ends.push_back(values.size());
  };
  // Forces alone: accelerations may jump where a driver's do, at its own time.
  assembly_.calc_force_partials(s);
  for (const auto* block : {&assembly_.K, &assembly_.C, &assembly_.Q_z, &assembly_.f_q, &assembly_.f_v, &assembly_.f_z})
    add(block->data(), block->size());
  assembly_.calc_parameter_columns(s, columns_);
  for (const auto* block : {&columns_.F, &columns_.f}) add(block->data(), static_cast<std::size_t>(block->size()));
  // What is steep there is continuous, but for this.
  const std::size_t steep = values.size();
  SteepBegins::of(assembly_).append(s, values);
  if (values.size() > steep) ends.push_back(values.size());
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
  SteepBegins::of(assembly_).refuse_between(view(bend.before, bend.state_before.data()),
                                            view(bend.after, bend.state_after.data()));
  const int N = state_size(), k = directions();
  const Mechanism& mechanism = assembly_.mechanism();
  std::vector<ForceArguments> arguments;
  for (std::size_t i = 0; i < mechanism.forces().size(); ++i)
    arguments.emplace_back(*mechanism.forces()[i], mechanism.state_offsets()[i], assembly_);
  std::array<std::vector<ForceSide>, 2> forces;
  std::array<VectorXd, 2> a, cost;
  for (const std::size_t side : {0, 1}) {
    const std::vector<double>& y = side == 0 ? bend.state_before : bend.state_after;
    evaluate(side == 0 ? bend.before : bend.after, y.data(), y.data() + N);
    const StateView s = level_.state();
    a[side] = Eigen::Map<const VectorXd>(s.a, n_);
    gradient_.set_zero();
    objective_.add_running_gradient(s, assembly_, gradient_);
    cost[side] = joined(gradient_);
    for (const ForceArguments& x : arguments) {
      ForceSide& f = forces[side].emplace_back();
      const auto rows = static_cast<Index>(x.force().coordinates().size());
      f.value.setZero(rows + x.force().states());
      x.force().calc_force(assembly_.gather(x.force(), 0, s), f.value.data(), f.value.data() + rows);
      f.derivatives = force_derivatives(x, assembly_, s);
      f.rate =
          f.derivatives * x.gathered(s.v, s.a, assembly_.zdot.data(), nullptr) + explicit_rate(x.force(), assembly_, s);
      f.along.resize(f.value.size(), k);
      for (int j = 0; j < k; ++j) {
        const Variation d = variation(j);
        f.along.col(j) = f.derivatives * x.gathered(d.q, d.v, d.z, d.numbers);
      }
    }
  }
  const VectorXd largest = sizes.columns.col(0), largest_a = largest.segment(n_, n_);
  const bool jerks = ((a[1] - a[0]).cwiseAbs() - 10 * kJumpOf * largest_a).maxCoeff() > 1e-9 * largest_a.maxCoeff();
  bool jumps = false;
  bend.moved.clear();
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const ForceArguments& x = arguments[i];
    const ForceSide &f = forces[0][i], &g = forces[1][i];
    BendScale by{bend.before, bend.after - bend.before, sizes.span, MatrixXd(x.size(), 1 + k)};
    for (int j = 0; j <= k; ++j) {
      const double* size = sizes.columns.col(j).data();
      const double* numbers = j > 0 ? number_changes_[static_cast<std::size_t>(j - 1)].data() : nullptr;
      by.arguments.col(j) = x.gathered(size, size + n_, size + 2 * n_, numbers).cwiseAbs();
    }
    if (value_jumps(f, g, by)) {
      jumps = true;
      continue;
    }
    if (f.derivatives.size() == 0 || !differ(f.derivatives, g.derivatives)) continue;
    const std::string name = x.force().path();
    if (jerks) refuse(bend.before, fmt::format("'{}' bends where accelerations jump", name));
    bend.moved.emplace_back(i, moved_instant(name, f, g, by));
  }
  if (!bend.moved.empty() || jerks || jumps || objective_.running.empty()) return;
  ScalarGradient size = gradient_;
  size.q = largest.head(n_);
  size.v = size.a = largest_a;
  size.z = largest.tail(nz_);
  size.lambda = Eigen::Map<const VectorXd>(level_.state().lambda, m_).cwiseAbs();
  for (int j = 0; j < parameter_count(); ++j)
    size.rho[j] = assembly_.parameters().parameters[static_cast<std::size_t>(j)].scale;
  if (cost_bends(cost[0], cost[1], joined(size), parameter_count()))
    refuse(bend.before, "the derivative of the running cost jumps");
}

void HessianEquations::cross_bend(const Bend& bend, const double* mu, double* dmu, double* products) {
  const int N = state_size(), np = parameter_count();
  const Mechanism& mechanism = assembly_.mechanism();
  std::vector<ForceArguments> arguments;
  for (const auto& [i, moved] : bend.moved)
    arguments.emplace_back(*mechanism.forces()[i], mechanism.state_offsets()[i], assembly_);
  // (L_x, L_rho) on both sides, at one and the same mu, whose own part of -mu' cancels; and the forces' derivatives.
  std::array<VectorXd, 2> L;
  std::array<std::vector<MatrixXd>, 2> derivatives;
  for (const std::size_t side : {0, 1}) {
    const std::vector<double>& y = side == 0 ? bend.state_before : bend.state_after;
    evaluate(side == 0 ? bend.before : bend.after, y.data(), y.data() + N);
    L[side].resize(N + np);
    adjoint(mu, L[side].data(), L[side].data() + N);
    L[side].head(N) *= -1;
    for (const ForceArguments& x : arguments)
      derivatives[side].push_back(force_derivatives(x, assembly_, level_.state()));
  }
  VectorXd jump = L[1] - L[0];
  const double size = std::max(L[0].cwiseAbs().maxCoeff(), L[1].cwiseAbs().maxCoeff());
  const auto cross = [&](const VectorXd& by, const VectorXd& moved) {
    Eigen::Map<MatrixXd>(dmu, N, directions()) -= by.head(N) * moved.transpose();
    Eigen::Map<MatrixXd>(products, np, directions()) -= by.tail(np) * moved.transpose();
  };
  bool together = true;
  for (const auto& [i, moved] : bend.moved) {
    const VectorXd& first = bend.moved.front().second;
    together = together && (moved - first).cwiseAbs().maxCoeff() <= kJumpOf * first.cwiseAbs().maxCoeff();
  }
  if (together) {
    if (!bend.moved.empty()) cross(jump, bend.moved.front().second);
    return;
  }
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const VectorXd w = arguments[i].weights(s_.data(), mu + 2 * n_);
    VectorXd own = VectorXd::Zero(N + np);
    arguments[i].scatter((derivatives[1][i] - derivatives[0][i]).transpose() * w, own);
    cross(own, bend.moved[i].second);
    jump -= own;
  }
  if (jump.cwiseAbs().maxCoeff() > kRankOne * size)
    refuse(bend.before, "several forces bend, and the running cost with them");
}

}  // namespace costate
