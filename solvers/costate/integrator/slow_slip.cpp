#include "costate/integrator/slow_slip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/assembly/packed_state.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/discrete/explicit_scheme.h"
#include "costate/element/force/rigid_contact.h"
#include "costate/level/penalty_weight.h"

namespace costate {

namespace {
// Of the run's tolerance.
constexpr double kSlipTolerance = 0.1, kSlipSmallest = 1e-12;
// Of |w|, the error of velocities in a step; of sizes that need no digits of their own.
constexpr double kOfSpeed = 0.1, kOfSize = 1e-3;
constexpr double kSlipSafety = 0.9, kSlipGrowth = 4, kSlipCut = 0.2;
// A slip stops where it is as slow as this, of |w| where the stretch begins.
constexpr double kSlipStopped = 1e-8;
// |w| grows again once it is so many times the least.
constexpr double kSlipGrows = 2;
constexpr int kMostSlipSteps = 20000, kMostRadauSteps = 150;
constexpr double kSlipRounding = 16 * std::numeric_limits<double>::epsilon();

[[noreturn]] void refuse_slow(double begin, long steps, double t) {
  throw CapabilityError(
      fmt::format("At t = {:.9g} s a slip in space is slow for so long that adjoints do not "
                  "follow it: {} steps come to t = {:.9g} s. Take idas-forward or cvodes-forward.",
                  begin, steps, t));
}
}  // namespace

SlowSlip::SlowSlip(const Assembly& of_run, const Objective& objective, const MotionEvents::History& history,
                   bool redundant)
    : assembly_(of_run.mechanism_ptr(), of_run.parameters()),
      objective_(objective),
      // Constraints are kept exactly in either form, so that one serves all formulations.
      level_(assembly_, redundant ? augmented_stabilization(assembly_.mechanism_ptr()) : Stabilization{}),
      velocity_jump_(assembly_, level_),
      events_(assembly_),
      n_(assembly_.n()),
      m_(assembly_.m()),
      nz_(assembly_.nz()),
      np_(assembly_.np()),
      size_(2 * n_ + nz_) {
  assembly_.set_parameters(of_run.rho().data());
  cost_.resize(assembly_);
  events_.use(velocity_jump_.balance());
  events_.recall(history);
  events_.carry_slips_from_rest();
}

SlowSlip::Columns SlowSlip::start(const double* x) const {
  Columns Y = Columns::Zero(size_ + 1, 1 + size_ + np_);
  std::copy(x, x + size_, Y.data());
  Y.block(0, 1, size_, size_).setIdentity();
  return Y;
}

double SlowSlip::slip(double t, const double* x) { return events_.slowest_in_space(packed_view(t, x, n_)).speed; }

double SlowSlip::parts_of_slips(const double* x) const { return costate::parts_of_slips(assembly_, x + n_); }

void SlowSlip::rates(double t, const double* x, Eigen::VectorXd& f, Eigen::MatrixXd& A) {
  const Columns F = column_rates(t, start(x));
  f = F.col(0).head(size_);
  A = F.rightCols(size_ + np_).topRows(size_);
}

void SlowSlip::changes(double t, const double* x, const Eigen::MatrixXd&, std::vector<Eigen::MatrixXd>& all) {
  all.assign(1, column_rates(t, start(x)).rightCols(size_ + np_));
}

MotionEvents::Side SlowSlip::side(const StateView& s) {
  level_.solve(s);
  MotionEvents::Side r;
  r.a.assign(level_.a(), level_.a() + n_);
  r.zdot = assembly_.zdot;
  r.cost = objective_.running.empty() ? 0 : objective_.running_value(level_.state(), assembly_);
  return r;
}

SlowSlip::Columns SlowSlip::column_rates(double t, const Columns& Y) {
  Columns F = Columns::Zero(Y.rows(), Y.cols());
  level_.solve(packed_view(t, Y.data(), n_));
  level_.linearize();
  const StateView s = level_.state();
  const std::vector<double> zdot = assembly_.zdot;
  F.col(0).head(n_) = Y.col(0).segment(n_, n_);
  F.col(0).segment(n_, n_) = Eigen::Map<const Eigen::VectorXd>(level_.a(), n_);
  std::copy(zdot.begin(), zdot.end(), F.data() + 2 * n_);
  const bool costs = !objective_.running.empty();
  if (costs) F(size_, 0) = objective_.running_value(s, assembly_);
  assembly_.calc_parameter_columns(s, columns_);
  Eigen::MatrixXd x(n_ + m_, size_ + np_);
  std::vector<const double*> columns;
  for (int j = 1; j < Y.cols(); ++j) columns.push_back(Y.col(j).data());
  level_.solve_tangent(columns.data(), size_, nullptr, x.data());
  level_.solve_tangent(columns.data() + size_, np_, &columns_, x.col(size_).data());
  F.rightCols(size_ + np_).topRows(n_) = Y.rightCols(size_ + np_).middleRows(n_, n_);
  F.rightCols(size_ + np_).middleRows(n_, n_) = x.topRows(n_);
  if (nz_ > 0) F.rightCols(np_).middleRows(2 * n_, nz_) = columns_.f;
  for (int j = 1; j < Y.cols(); ++j)
    level_.add_state_rows(1, Y.col(j).data(), Y.col(j).data() + n_, Y.col(j).data() + 2 * n_, F.col(j).data() + 2 * n_);
  if (!costs) return F;
  cost_.set_zero();
  objective_.add_running_gradient(s, assembly_, cost_);
  Eigen::VectorXd g(size_);
  g << cost_.q, cost_.v, cost_.z;
  F.row(size_).tail(size_ + np_) = g.transpose() * Y.rightCols(size_ + np_).topRows(size_) +
                                   cost_.a.transpose() * x.topRows(n_) + cost_.lambda.transpose() * x.bottomRows(m_);
  F.row(size_).tail(np_) += cost_.rho.transpose();
  psi_parts_ = g.cwiseAbs().transpose() * Y.rightCols(size_ + np_).topRows(size_).cwiseAbs() +
               cost_.a.cwiseAbs().transpose() * x.topRows(n_).cwiseAbs() +
               cost_.lambda.cwiseAbs().transpose() * x.bottomRows(m_).cwiseAbs();
  psi_by_reactions_ = cost_.lambda.cwiseAbs().dot(Eigen::Map<const Eigen::VectorXd>(s.lambda, m_).cwiseAbs());
  return F;
}

double SlowSlip::step(double t, double h, const Columns& Y, double speed, double rtol, Columns& next,
                      std::vector<Columns>& ks) {
  const ExplicitScheme& scheme = *find_explicit_scheme("dop853");
  const auto sum = [&](const std::vector<double>& weights) {
    Columns s = Columns::Zero(Y.rows(), Y.cols());
    for (std::size_t i = 0; i < std::min(weights.size(), ks.size()); ++i)
      if (weights[i] != 0) s += (h * weights[i]) * ks[i];
    return s;
  };
  ks.resize(1);
  for (int i = 1; i < scheme.stages; ++i)
    ks.push_back(
        column_rates(t + scheme.c[static_cast<std::size_t>(i)] * h, Y + sum(scheme.a[static_cast<std::size_t>(i)])));
  next = Y + sum(scheme.weights());
  const Columns fine = sum(scheme.error), coarse = sum(scheme.error_low);
  // By blocks of x and psi. A tangent counts by what it changes: x by its own size, a parameter by its scale.
  const int first[] = {0, n_, 2 * n_, size_, size_ + 1};
  Eigen::VectorXd largest(4), change(Y.cols());
  for (int b = 0; b < 4; ++b) {
    const int rows = first[b + 1] - first[b];
    largest[b] = rows == 0 ? 0
                           : std::max(Y.col(0).segment(first[b], rows).cwiseAbs().maxCoeff(),
                                      next.col(0).segment(first[b], rows).cwiseAbs().maxCoeff());
  }
  for (int j = 0; j < size_; ++j) change[1 + j] = std::max(largest[j < n_ ? 0 : j < 2 * n_ ? 1 : 2], speed);
  for (int j = 0; j < np_; ++j)
    change[1 + size_ + j] = assembly_.parameters().parameters[static_cast<std::size_t>(j)].scale;
  change[0] = 1;
  // psi counts from the stretch's beginning on: by what it comes to at this rate, whatever it depends on.
  for (int j = 0; j < Y.cols(); ++j)
    largest[3] =
        std::max(largest[3], change[j] * std::max(span_ * std::abs(ks.front()(size_, j)), std::abs(Y(size_, j))));
  // What rounding makes of the direction, of what friction does in this step: w may be a difference of larger
  // velocities.
  const double turn = h * ks.front().col(0).segment(n_, n_).cwiseAbs().maxCoeff() / speed,
               rounding = kSlipRounding * costate::parts_of_slips(assembly_, level_.state().v) / speed,
               direction = rounding * std::min(1.0, turn);
  double worst = 0;
  for (int b = 0; b < 4; ++b)
    for (int j = 0; j < Y.cols(); ++j) {
      const int rows = first[b + 1] - first[b];
      if (rows == 0) continue;
      const auto block = [&](const Columns& of) { return of.col(j).segment(first[b], rows).cwiseAbs().maxCoeff(); };
      const double e = block(fine), low = block(coarse), error = e > 0 ? e / std::hypot(1, 0.1 * (low / e)) : 0;
      const double size = std::max({block(Y), block(next), (b < 3 ? kOfSize : 1) * largest[b] / change[j]});
      double allowed = rtol * size;
      if (j == 0 && b == 1) allowed = rtol * kOfSpeed * speed;
      if (b == 1) allowed += direction * (j == 0 ? speed : size);
      allowed += kSlipRounding * (size + h * block(ks.front()));
      // Of how a column turns the direction, dw/|w| but for its part along it.
      if (b == 3 && j > 0 && psi_parts_.size() > 0)
        allowed += rounding * h *
                   (psi_parts_[j - 1] + psi_by_reactions_ * Y.col(j).segment(n_, n_).cwiseAbs().maxCoeff() / speed);
      if (error > 0) worst = std::max(worst, error / allowed);
      if (!std::isfinite(error)) return std::numeric_limits<double>::infinity();
    }
  return worst;
}

bool SlowSlip::run(const SlowStretch& stretch, double slowest, double rtol, double& t, Columns& Y) {
  const double span = span_ = stretch.end - stretch.begin, far = stretch.end + 10 * span;
  if (!(span > 0)) return true;
  const bool stops = stretch.stop >= 0;
  double h = 0.1 * span, now = slip(t, Y.data()), least = now;
  Columns next;
  std::vector<Columns> ks{column_rates(t, Y)};
  for (int steps = 0; stops ? now > slowest : t < stretch.end; ++steps) {
    if (steps > kMostSlipSteps) refuse_slow(stretch.begin, steps, t);
    if (t > far || !(t + 1e-3 * h > t)) return false;
    const bool last = !stops && h >= stretch.end - t;
    if (last) h = stretch.end - t;
    const double error = step(t, h, Y, now, rtol, next, ks);
    const double factor = error > 0 ? kSlipSafety * std::pow(error, -0.125) : kSlipGrowth;
    if (error <= 1) {
      t = last ? stretch.end : t + h;
      Y = next;
      ks.assign(1, column_rates(t, Y));
      now = slip(t, Y.data());
      least = std::min(least, now);
      if (stops && now > kSlipGrows * least) return false;
    }
    h *= std::clamp(factor, kSlipCut, error <= 1 ? kSlipGrowth : 0.9);
  }
  return true;
}

void SlowSlip::cross(int event, double t, Columns& Y) {
  const std::vector<double> x(Y.data(), Y.data() + size_);
  std::vector<double> after = x;
  const StateView before = packed_view(t, x.data(), n_);
  const MotionEvents::Side minus = side(before);
  events_.cross(event, before, after.data() + n_, after.data() + 2 * n_);
  const MotionEvents::Side plus = side(packed_view(t, after.data(), n_));
  level_.solve(before);  // where impulses are solved for
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(np_, size_ + np_);
  directions.rightCols(np_).setIdentity();
  Eigen::MatrixXd S = Y.rightCols(size_ + np_).topRows(size_);
  std::vector<double*> columns;
  for (Eigen::Index j = 0; j < S.cols(); ++j) columns.push_back(S.col(j).data());
  std::vector<double> dcost(columns.size(), 0);
  events_.tangent(event, before, minus, plus, columns.data(), size_ + np_, dcost.data(), &directions);
  Y.rightCols(size_ + np_).topRows(size_) = S;
  Y.row(size_).tail(size_ + np_) += Eigen::Map<const Eigen::RowVectorXd>(dcost.data(), size_ + np_);
  std::copy(after.begin(), after.end(), Y.data());
}

StretchMap SlowSlip::map_from_rest(const SlowStretch& stretch, double rtol) {
  Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(stretch.before.data(), size_);
  std::vector<Eigen::MatrixXd> tangents{Eigen::MatrixXd::Zero(size_ + 1, size_ + np_)};
  tangents[0].topLeftCorner(size_, size_).setIdentity();
  SlipSteps steps(*this, rtol, Eigen::MatrixXd(np_, 0));
  const double t = steps.run(stretch.begin, stretch.end, x, tangents,
                             Eigen::Map<const Eigen::VectorXd>(stretch.after.data(), size_), kMostRadauSteps);
  if (t < stretch.end) refuse_slow(stretch.begin, steps.steps(), t);
  StretchMap map;
  map.before = stretch.before;
  map.after = stretch.after;
  map.X = tangents[0].topRows(size_);
  map.c = tangents[0].row(size_).transpose();
  return map;
}

StretchMap SlowSlip::map(const SlowStretch& stretch, double rtol) {
  const double fine = std::max(kSlipTolerance * rtol, kSlipSmallest);
  if (stretch.from_rest) return map_from_rest(stretch, fine);
  const Columns begin = start(stretch.before.data());
  Columns Y;
  double t = 0;
  const auto reaches = [&](double slowest) {
    t = stretch.begin;
    Y = begin;
    return run(stretch, slowest, fine, t, Y);
  };
  const bool stops = stretch.stop >= 0;
  // Where the run took it to stop it may be slow for a while and go on, by less than the run tells.
  const double slow = std::min(0.5 * kSlidingOffset, kSlipStopped * slip(stretch.begin, begin.data()));
  bool same = reaches(slow) || (stops && reaches(stretch.last_speed));
  if (same && stops) {
    cross(stretch.stop, t, Y);
    same = events_.same_modes(Y.data() + 2 * n_, stretch.after.data() + 2 * n_);
  }
  if (!same)
    throw CapabilityError(
        fmt::format("At t = {:.9g} s a slip in space nearly stops; within the run's errors it "
                    "stops there or goes on, and adjoints do not tell which. Take idas-forward or cvodes-forward, or "
                    "a smaller rtol.",
                    stretch.end));
  StretchMap map;
  map.before = stretch.before;
  map.after = stretch.after;
  map.X = Y.rightCols(size_ + np_).topRows(size_);
  map.c = Y.row(size_).tail(size_ + np_).transpose();
  return map;
}

}  // namespace costate
