#include "costate/integrator/radau_linear.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"

namespace costate {

namespace {
// The estimate is one of order s for a result of order 2 s - 1: a tolerance of this power keeps the latter's error near
// rtol, as in the source's program. The factor (0.1 there) leaves the gradient's error to that of the motion.
double step_tolerance(double rtol, int s) { return 0.02 * std::pow(rtol, (s + 1.0) / (2.0 * s)); }
constexpr double kSafety = 0.9, kLargestGrowth = 5, kLargestCut = 0.2;
// Steps that might grow by less stay as they are, and may do with the factors of the one before.
constexpr double kNoGrowth = 1.2;
// Errors per relative change of a parameter, of a tangent or of the gradient, that need no smaller steps; in absolute
// tolerances of the motion. At rest, and at an optimum where psi vanishes, they are nothing but the motion's own
// errors, and rough.
constexpr double kSmallError = 1e-2;
constexpr double kNoSize = 1e-200;
// What evaluations leave of the digits: a group of unknowns that is nothing but this of the others has no digits.
constexpr double kLostDigits = 1e-14;
// Of the solution of a step's stages, in rtol of the motion; of steps that do not follow their error; and of the error.
constexpr double kSolveTolerance = 1e-3, kSolveByGrid = 1e-13, kErrorDigits = 5e-2;
// Of the span and the tolerance: a kink of the forces is not resolved below this. A step over one leaves itself times
// what the rates jump by: contacts that are stiff (their damping some 1e3 1/s) ask for far less than the tolerance. And
// of the span, at least.
constexpr double kSmallestStep = 1e-3, kShortestStep = 3e-13;
// Of the span: from here on the two sides of a kink, or of a jump and a kink, are one instant to the solution.
constexpr double kOneInstant = 1e-13;
// Columns smaller than this fraction of the largest one (per relative change of the parameter) need no digits of their
// own.
constexpr double kSmallColumn = 1e-2;
// More steps than so many for one of the motion, whose integrator is of about the same order, mean that the estimate
// has stopped falling with the step.
constexpr long kMostSteps = 50;
}  // namespace

RadauLinear::RadauLinear(HandEquations& equations, const RadauScheme& scheme, std::vector<double> parameter_sizes)
    : eq_(equations),
      scheme_(scheme),
      s_(scheme.stages),
      N_(equations.size()),
      k_(equations.columns()),
      parameter_sizes_(std::move(parameter_sizes)),
      system_(equations, scheme),
      stages_(static_cast<std::size_t>(scheme.stages)) {}

void RadauLinear::calc_momentum(const Eigen::MatrixXd& X, Eigen::MatrixXd& out) const {
  out = eq_.d();
  for (int j = 0; j < k_; ++j) add_product(eq_.pattern(), eq_.D().data(), 1, X.col(j).data(), out.col(j).data());
}

void RadauLinear::calc_flow(std::span<const double> A, Stage& s) const {
  s.f = s.b;
  for (int j = 0; j < k_; ++j) add_product(eq_.pattern(), A.data(), 1, s.X.col(j).data(), s.f.col(j).data());
}

void RadauLinear::take_columns(Stage& s) const {
  s.b = eq_.b();
  s.d = eq_.d();
}

double RadauLinear::attempt(const Trajectory& trajectory, double t0, double next, double tolerance,
                            RadauResult& result) {
  const bool forward = eq_.direction() == HandEquations::Direction::forward;
  const double h = next - t0;
  for (int i = 0; i < s_; ++i) {
    const double t = i == s_ - 1 ? next : t0 + scheme_.c[static_cast<std::size_t>(i)] * h;
    trajectory.evaluate(t, point_.data());
    eq_.evaluate(t, point_.data());
    ++result.evaluations;
    eq_.keep(i);
    take_columns(stages_[static_cast<std::size_t>(i)]);
    system_.take(i);
  }
  right_.resize(s_ * N_, k_);
  for (int i = 0; i < s_; ++i)
    for (int j = 0; j < k_; ++j)
      for (int row = 0; row < N_; ++row) {
        const Stage& own = stages_[static_cast<std::size_t>(i)];
        double x = -own.b(row, j);
        if (eq_.differential(row)) {
          x = momentum_(row, j) - own.d(row, j);
          for (int l = 0; l < s_; ++l) x += h * scheme_.a(i, l) * stages_[static_cast<std::size_t>(l)].b(row, j);
        }
        right_(i * N_ + row, j) = x;
      }
  int bad = system_.prepare(h);
  if (bad < 0) bad = system_.solve(right_, solve_tolerance_);
  if (bad >= 0)
    throw SolverError(fmt::format("The hand-derived equations are singular at t = {:.9g} s, unknown '{}'.", t0,
                                  eq_.names()[static_cast<std::size_t>(bad)]));
  for (int i = 0; i < s_; ++i) {
    Stage& own = stages_[static_cast<std::size_t>(i)];
    own.X = right_.middleRows(i * N_, N_);
    calc_flow(system_.A(i), own);
  }
  calc_momentum(stages_.back().X, momentum_after_);
  // The integrand last: for some equations it evaluates the kept points again.
  Eigen::VectorXd change = scheme_.error[0] * begin_.integrand;
  gradient_after_ = gradient_;
  for (int i = s_ - 1; i >= 0; --i) {
    Stage& own = stages_[static_cast<std::size_t>(i)];
    eq_.recall(i);
    eq_.integrand(own.X, own.integrand);
    gradient_after_ += (forward ? h : -h) * scheme_.weight(i) * own.integrand;
    change += scheme_.error[static_cast<std::size_t>(i) + 1] * own.integrand;
  }
  result.factorizations = system_.factorizations() - factorizations_before_;
  return std::max(state_error(h, tolerance), integral_error(h * change, tolerance));
}

double RadauLinear::state_error(double h, double tolerance) {
  for (int j = 0; j < k_; ++j)
    for (int row = 0; row < N_; ++row) {
      double x = 0;
      if (eq_.differential(row)) {
        x = scheme_.error[0] * begin_.f(row, j);
        for (std::size_t l = 0; l < stages_.size(); ++l) x += scheme_.error[l + 1] * stages_[l].f(row, j);
      }
      for (int i = 0; i < s_; ++i) right_(i * N_ + row, j) = h * x;
    }
  if (system_.solve(right_, kErrorDigits) >= 0) return std::numeric_limits<double>::infinity();
  Eigen::ArrayXXd squares = Eigen::ArrayXXd::Zero(eq_.groups(), k_), counts = squares;
  size_after_ = size_;
  for (int j = 0; j < k_; ++j)
    for (int row = 0; row < N_; ++row) {
      if (!eq_.differential(row)) continue;
      const int group = eq_.group(row);
      const double error = right_((s_ - 1) * N_ + row, j);
      squares(group, j) += error * error;
      ++counts(group, j);
      size_after_(group, j) = std::max(size_after_(group, j), std::abs(stages_.back().X(row, j)));
    }
  const bool forward = eq_.direction() == HandEquations::Direction::forward;
  double largest_error = 0;
  const double rounding = size_after_.size() > 0 ? kLostDigits * size_after_.maxCoeff() : 0;
  for (int group = 0; group < eq_.groups(); ++group) {
    const auto per_change = [&](int j) { return k_ > 1 ? parameter_sizes_[static_cast<std::size_t>(j)] : 1.0; };
    double largest = 0;
    for (int j = 0; j < k_; ++j) largest = std::max(largest, size_after_(group, j) * per_change(j));
    for (int j = 0; j < k_; ++j) {
      const double size = std::max(size_after_(group, j), kSmallColumn * largest / per_change(j));
      if (squares(group, j) == 0) continue;
      const double smallest =
          forward ? smallest_error_ / parameter_sizes_[static_cast<std::size_t>(j)] : smallest_of_group_[group];
      // An adjoint that is zero until a cost or a contact comes has no size yet: its error is large, but a number.
      const double error =
          std::sqrt(squares(group, j) / counts(group, j)) / std::max(tolerance * size + smallest + rounding, kNoSize);
      if (!std::isfinite(error)) return std::numeric_limits<double>::infinity();
      largest_error = std::max(largest_error, error);
    }
  }
  return largest_error;
}

double RadauLinear::integral_error(const Eigen::VectorXd& error, double tolerance) {
  gradient_size_after_ = gradient_size_;
  double largest = 0;
  for (Eigen::Index j = 0; j < error.size(); ++j) {
    const double size = parameter_sizes_[static_cast<std::size_t>(j)];
    gradient_size_after_ = std::max(gradient_size_after_, size * std::abs(gradient_after_[j]));
    largest = std::max(largest, size * std::abs(error[j]));
    // A maximum would lose what is no number: a cost's derivative outside its domain.
    if (!std::isfinite(error[j])) return std::numeric_limits<double>::infinity();
  }
  return largest > 0 ? largest / (tolerance * gradient_size_after_ + smallest_error_) : 0;
}

Eigen::VectorXd RadauLinear::change_by_tolerance(const Trajectory& trajectory, const std::vector<double>& grid,
                                                 double atol) {
  constexpr int kLooks = 8;
  const double span = grid.back() - grid.front();
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(eq_.groups()), unused = gradient_;
  const auto add = [&](const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, double weight) {
    for (int row = 0; row < N_; ++row) {
      double& most = largest[eq_.group(row)];
      const double change = weight * (y.row(row) - x.row(row)).cwiseAbs().maxCoeff();
      if (eq_.differential(row) && change > most) most = change;
    }
  };
  Eigen::MatrixXd X(N_, k_), X_moved(N_, k_);
  for (int look = 0; look <= kLooks; ++look) {
    // The end itself, where the adjoint begins, and times that are not round.
    const double t = look == 0 ? grid.back() : grid.front() + (look - 0.618034) / kLooks * span;
    trajectory.evaluate(t, point_.data());
    eq_.evaluate(t, point_.data());
    const Eigen::MatrixXd b = eq_.b();
    if (look == 0) eq_.begin(X, unused);
    for (std::size_t i = 0; i < point_.size(); ++i)
      point_[i] += (std::cos(2.4 * static_cast<double>(i) + 0.3) > 0 ? atol : -atol);
    eq_.evaluate(t, point_.data());
    add(b, eq_.b(), span);
    if (look == 0) eq_.begin(X_moved, unused);
    if (look == 0) add(X, X_moved, 1);
  }
  return largest;
}

void RadauLinear::begin_at(const Trajectory& trajectory, double t, const Eigen::MatrixXd& X) {
  trajectory.evaluate(t, point_.data());
  eq_.evaluate(t, point_.data());
  begin_.X = X;
  take_columns(begin_);
  calc_flow(eq_.A(), begin_);
  calc_momentum(X, momentum_);
  eq_.integrand(X, begin_.integrand);
}

const MotionJump* RadauLinear::jump_at(double t) const {
  const auto& jumps = eq_.jumps();
  const auto at =
      std::lower_bound(jumps.begin(), jumps.end(), t, [](const MotionJump& j, double x) { return j.before < x; });
  return at != jumps.end() && at->before == t ? &*at : nullptr;
}

void RadauLinear::cross(const Trajectory& trajectory, const MotionJump& jump, Eigen::MatrixXd& X) {
  trajectory.evaluate(jump.before, point_.data());
  eq_.cross(jump, point_.data(), X, gradient_);
  begin_at(trajectory, eq_.direction() == HandEquations::Direction::forward ? jump.after : jump.before, X);
}

RadauResult RadauLinear::integrate(const Trajectory& trajectory, const std::vector<double>& grid, double rtol,
                                   double atol, const Watch& watch) {
  smallest_error_ = kSmallError * atol;
  solve_tolerance_ = rtol > 0 ? kSolveTolerance * rtol : kSolveByGrid;
  factorizations_before_ = system_.factorizations();
  const bool forward = eq_.direction() == HandEquations::Direction::forward;
  const std::size_t count = grid.size();
  const auto time = [&](std::size_t i) { return forward ? grid[i] : grid[count - 1 - i]; };
  const double span = grid.back() - grid.front(), smallest = std::max(kSmallestStep * rtol, kShortestStep) * span;
  const bool adaptive = rtol > 0;
  const double tolerance = adaptive ? step_tolerance(rtol, s_) : 1;
  const long most_steps = kMostSteps * static_cast<long>(trajectory.steps()) + 1000;
  RadauResult r;
  point_.resize(static_cast<std::size_t>(trajectory.width()));
  gradient_ = Eigen::VectorXd::Zero(eq_.parameter_count());
  size_ = Eigen::MatrixXd::Zero(eq_.groups(), k_);
  gradient_size_ = 0;
  for (Stage& s : stages_) s.integrand.resize(gradient_.size());
  begin_.integrand.resize(gradient_.size());
  smallest_of_group_ = Eigen::VectorXd::Zero(eq_.groups());
  if (adaptive && !forward) smallest_of_group_ = kSmallError * change_by_tolerance(trajectory, grid, atol);
  Eigen::MatrixXd X(N_, k_);
  double t = time(0), h = count > 1 ? 0.1 * std::abs(time(1) - t) : 0;
  trajectory.evaluate(t, point_.data());
  eq_.evaluate(t, point_.data());
  eq_.begin(X, gradient_);
  begin_at(trajectory, t, X);
  bool rejected = false;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    X = begin_.X;
    if (const MotionJump* jump = jump_at(time(i))) {
      cross(trajectory, *jump, X);
      t = forward ? std::min(jump->after, time(i + 1)) : jump->before;
    }
    const MotionJump* ahead = forward ? nullptr : jump_at(time(i + 1));
    const double end = ahead ? std::min(ahead->after, t) : time(i + 1);
    trajectory.evaluate(t, point_.data());
    if (eq_.before_step(t, end, point_.data(), X, gradient_)) begin_at(trajectory, t, X);
    if (adaptive && t != end && std::abs(end - t) <= kOneInstant * span) {
      X = begin_.X;
      t = end;
      begin_at(trajectory, t, X);
    }
    while (t != end) {
      // Equal steps to the end rather than a small last one.
      const double left = std::abs(end - t), steps = adaptive ? std::max(1.0, std::ceil(left / h * (1 - 1e-3))) : 1;
      const double step = std::min(left / steps, left);
      const double next = steps == 1 ? end : forward ? t + step : t - step;
      const double error = attempt(trajectory, t, next, tolerance, r);
      const bool smallest_reached = step <= smallest;
      double factor = error > 0 ? kSafety * std::pow(error, -1.0 / (s_ + 1)) : kLargestGrowth;
      if (!(factor > kLargestCut)) factor = kLargestCut;
      factor = std::min(factor, rejected ? 1 : kLargestGrowth);
      if (factor > 1 && factor < kNoGrowth) factor = 1;
      rejected = adaptive && !(error <= 1) && !smallest_reached;
      h = std::max(step * factor, 0.9 * smallest);
      if (rejected) {
        ++r.rejected;
        continue;
      }
      if (!std::isfinite(error))
        throw SolverError(fmt::format("The hand-derived equations' solution grows without bound at t = {:.9g} s.", t));
      std::swap(begin_, stages_.back());
      std::swap(momentum_, momentum_after_);
      std::swap(size_, size_after_);
      std::swap(gradient_, gradient_after_);
      gradient_size_ = gradient_size_after_;
      t = next;
      if (++r.steps > most_steps && adaptive)
        throw SolverError(
            fmt::format("The hand-derived equations need {} steps of {:.3g} s at t = {:.9g} s, where the motion "
                        "had {} in all: their solution is too rough for rtol {:.3g}. Take another method, or "
                        "a larger rtol.",
                        r.steps, step, t, trajectory.steps(), rtol));
      if (watch) watch(t, r.steps);
    }
  }
  if (const MotionJump* jump = forward ? nullptr : jump_at(time(count - 1))) {
    X = begin_.X;
    cross(trajectory, *jump, X);
    t = jump->before;
  }
  trajectory.evaluate(t, point_.data());
  eq_.evaluate(t, point_.data());
  eq_.finish(begin_.X, gradient_);
  r.gradient = gradient_;
  return r;
}

}  // namespace costate
