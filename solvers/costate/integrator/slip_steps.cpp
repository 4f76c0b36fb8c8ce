#include "costate/integrator/slip_steps.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "costate/adjoint/second_tangents.h"

namespace costate {

namespace {
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNoSolution = std::numeric_limits<double>::infinity();
// Of |w|, the error of velocities in a step.
constexpr double kOfSlipSpeed = 0.1;
// Of the stretch the first step, from rest and otherwise.
constexpr double kFirstStretchStep = 1e-6, kFirstOfMany = 0.05;
// What needs no digits of its own: of the largest column, and of what would change the motion by its size.
constexpr double kNoColumn = 1e-6, kOfChange = 1e-3;
constexpr double kStretchSafety = 0.9, kStretchGrowth = 5, kStretchCut = 0.2;
constexpr int kMostStretchIterations = 12;
// Of |w| where it begins: what has stopped. Its direction is known to 1e-8 there, of parts as large as a metre a
// second.
constexpr double kStoppedSlip = 1e-6;
// Of velocities; and of the parts that w is the sum of.
constexpr double kOwnRounding = 1e-13, kRoundingOfParts = 16 * std::numeric_limits<double>::epsilon();
}  // namespace

SlipSteps::SlipSteps(SlipSystem& system, double rtol, const MatrixXd& directions)
    : system_(system),
      scheme_(*find_radau_scheme("radau9")),
      rtol_(rtol),
      N_(system.state_size()),
      blocks_{{0, system.assembly().n(), 2 * system.assembly().n(), N_, N_ + 1}},
      directions_(directions) {}

double SlipSteps::run(double t, double end, VectorXd& x, Tangents& tangents, const VectorXd& last, int most) {
  speed_ = system_.slip(t, x.data());
  const bool from_rest = speed_ < system_.slip(end, last.data());
  const double nothing = from_rest ? 0 : kStoppedSlip * speed_;
  double h = (from_rest ? kFirstStretchStep : kFirstOfMany) * (end - t);
  set_least_sizes(end - t, x, last, end);
  evaluate(t, x, tangents, begin_);
  parts_ = system_.parts_of_slips(x.data());
  for (steps_ = 0; t < end; ++steps_) {
    if (steps_ > most || !(t + h > t)) return t;
    const bool ends = h >= end - t;
    if (ends) h = end - t;
    const double taken = h, error = attempt(t, h, x, tangents);
    const double factor = error > 0 ? kStretchSafety * std::pow(error, -1.0 / (scheme_.stages + 1)) : kStretchGrowth;
    h *= std::clamp(factor, kStretchCut, error <= 1 ? kStretchGrowth : 0.9);
    if (error > 1) continue;
    t = ends ? end : t + taken;
    x = x_after_;
    tangents = after_;
    std::swap(begin_, end_);
    parts_ = system_.parts_of_slips(x.data());
    const double before = std::exchange(speed_, system_.slip(t, x.data()));
    if (speed_ <= nothing) break;
    h *= std::min(1.0, speed_ / before);  // on the way to a stop steps are as what is left of it
  }
  return end;
}

void SlipSteps::evaluate(double t, const VectorXd& x, const Tangents& tangents, Point& at) {
  MatrixXd A;
  system_.rates(t, x.data(), at.f, A);
  system_.changes(t, x.data(), tangents[0], at.of);
  at.rates = tangent_rates(at.of, tangents);
}

double SlipSteps::attempt(double t, double h, const VectorXd& x, const Tangents& tangents) {
  const int s = scheme_.stages;
  const MatrixXd& a = scheme_.a;
  std::vector<VectorXd> X(static_cast<std::size_t>(s), x);
  std::vector<VectorXd> f(static_cast<std::size_t>(s));
  std::vector<MatrixXd> A(static_cast<std::size_t>(s));
  Eigen::PartialPivLU<MatrixXd> lu;
  const auto at = [](auto& all, int i) -> auto& { return all[static_cast<std::size_t>(i)]; };
  const auto factor = [&] {
    MatrixXd K = MatrixXd::Identity(s * N_, s * N_);
    for (int i = 0; i < s; ++i)
      for (int j = 0; j < s; ++j) K.block(i * N_, j * N_, N_, N_) -= h * a(i, j) * at(A, j).leftCols(N_);
    lu.compute(K);
    ++factorizations_;
  };
  double last = kNoSolution;
  for (int iteration = 0;; ++iteration) {
    if (iteration == kMostStretchIterations) return kNoSolution;
    for (int i = 0; i < s; ++i) system_.rates(scheme_.time(i, t, h, t + h), at(X, i).data(), at(f, i), at(A, i));
    factor();
    VectorXd left(s * N_);
    for (int i = 0; i < s; ++i) {
      left.segment(i * N_, N_) = x - at(X, i);
      for (int j = 0; j < s; ++j) left.segment(i * N_, N_) += h * a(i, j) * at(f, j);
    }
    const VectorXd change = lu.solve(left);
    if (!change.allFinite()) return kNoSolution;
    double size = 0;
    for (int i = 0; i < s; ++i) {
      at(X, i) += change.segment(i * N_, N_);
      size = std::max(size, measure(change.segment(i * N_, N_), x));
    }
    if (size > 2 * last) return kNoSolution;
    if (size < 1e-9 || (size >= 0.3 * last && size < 1)) break;
    last = size;
  }
  // At the stages as they are now.
  for (int i = 0; i < s; ++i) system_.rates(scheme_.time(i, t, h, t + h), at(X, i).data(), at(f, i), at(A, i));
  factor();
  x_after_ = at(X, s - 1);
  // S, then its changes, of which the stages' rates need S.
  const Eigen::Index M = tangents[0].cols();
  const auto stages_of = [&](const MatrixXd& from, const std::vector<MatrixXd>& forcing) {
    MatrixXd right(s * N_, M);
    for (int i = 0; i < s; ++i) {
      right.middleRows(i * N_, N_) = from.topRows(N_);
      for (int j = 0; j < s; ++j) right.middleRows(i * N_, N_) += h * a(i, j) * at(forcing, j).topRows(N_);
    }
    return MatrixXd(lu.solve(right));
  };
  std::vector<MatrixXd> forcing(static_cast<std::size_t>(s));
  for (int i = 0; i < s; ++i) {
    at(forcing, i) = MatrixXd::Zero(N_, M);
    at(forcing, i).rightCols(M - N_) = at(A, i).rightCols(M - N_);
  }
  std::vector<Tangents> stage(static_cast<std::size_t>(s), Tangents(tangents.size(), MatrixXd::Zero(N_ + 1, M)));
  MatrixXd solved = stages_of(tangents[0], forcing);
  std::vector<Tangents> of(static_cast<std::size_t>(s));
  for (int i = 0; i < s; ++i) {
    at(stage, i)[0].topRows(N_) = solved.middleRows(i * N_, N_);
    system_.changes(scheme_.time(i, t, h, t + h), at(X, i).data(), at(stage, i)[0], at(of, i));
  }
  const auto rates_of = [&] {
    std::vector<Tangents> rates;
    for (int i = 0; i < s; ++i) rates.push_back(tangent_rates(at(of, i), at(stage, i)));
    return rates;
  };
  const std::vector<Tangents> of_first = rates_of();  // what S makes of the changes' rates, which are zero yet
  for (std::size_t k = 1; k < tangents.size(); ++k) {
    for (int i = 0; i < s; ++i) at(forcing, i) = at(of_first, i)[k];
    solved = stages_of(tangents[k], forcing);
    for (int i = 0; i < s; ++i) at(stage, i)[k].topRows(N_) = solved.middleRows(i * N_, N_);
  }
  const std::vector<Tangents> rates = rates_of();
  after_ = at(stage, s - 1);
  for (std::size_t k = 0; k < tangents.size(); ++k) {
    after_[k].row(N_) = tangents[k].row(N_);
    for (int i = 0; i < s; ++i) after_[k].row(N_) += h * scheme_.weight(i) * at(rates, i)[k].row(N_);
  }
  end_ = {f.back(), of.back(), rates.back()};
  return error(h, x, tangents, f, rates);
}

double SlipSteps::error(double h, const VectorXd& x, const Tangents& tangents, const std::vector<VectorXd>& f,
                        const std::vector<Tangents>& rates) const {
  const double filter = scheme_.filter / h;
  const MatrixXd K = filter * MatrixXd::Identity(N_, N_) - begin_.of[0].topLeftCorner(N_, N_);
  const Eigen::PartialPivLU<MatrixXd> lu(K);
  const auto filtered = [&](MatrixXd e) {
    e.topRows(N_) = lu.solve(filter * e.topRows(N_)).eval();
    return e;
  };
  VectorXd e = h * scheme_.error[0] * begin_.f;
  for (std::size_t i = 0; i < f.size(); ++i) e += h * scheme_.error[i + 1] * f[i];
  double worst = measure(lu.solve(filter * e), x);
  // What rounding makes of the slip's direction, of what friction does in this step.
  const int n = blocks_.first[1];
  const double turn = h * begin_.f.segment(n, n).cwiseAbs().maxCoeff() / speed_,
               rounding = kRoundingOfParts * parts_ / speed_, direction = rounding * std::min(1.0, turn);
  const MatrixXd moved = system_.along(tangents[0]);
  for (std::size_t k = 0; k < tangents.size(); ++k) {
    MatrixXd e_k = h * scheme_.error[0] * begin_.rates[k];
    for (std::size_t i = 0; i < rates.size(); ++i) e_k += h * scheme_.error[i + 1] * rates[i][k];
    // The direction's change along another one is known as the direction is, in units of w by what w changes.
    const double turns =
        k == 0
            ? 1
            : std::max(1.0, moved.col(static_cast<Eigen::Index>(k) - 1).segment(n, n).cwiseAbs().maxCoeff() / speed_);
    worst = std::max(worst,
                     measure_tangents(filtered(e_k), tangents[k], after_[k], k,
                                      {turns * direction, turns * rounding * h * begin_.rates[k].row(N_).cwiseAbs()}));
  }
  const double allowed = scheme_.estimate_factor(rtol_);
  return std::isfinite(worst) ? worst / allowed : kNoSolution;
}

double SlipSteps::measure(const VectorXd& e, const VectorXd& x) const {
  const int n = system_.assembly().n();
  const auto part = [&](int first, int count, double size) {
    return count == 0 ? 0.0 : e.segment(first, count).cwiseAbs().maxCoeff() / (rtol_ * size);
  };
  const double rounding = 1e-4 * x.cwiseAbs().maxCoeff();
  return std::max({part(0, n, std::max(1e-3, x.head(n).cwiseAbs().maxCoeff())),
                   part(n, n, kOfSlipSpeed * speed_ + kOwnRounding * x.segment(n, n).cwiseAbs().maxCoeff() / rtol_),
                   part(2 * n, N_ - 2 * n, 1 + rounding)});
}

double SlipSteps::measure_tangents(const MatrixXd& e, const MatrixXd& from, const MatrixXd& to, std::size_t k,
                                   const Rounding& rounding) const {
  double worst = 0;
  for (int b = 0; b < 4; ++b) {
    const int first = blocks_.first[b], rows = blocks_.first[b + 1] - first;
    if (rows == 0) continue;
    const auto largest = [&](const auto& of) { return of.middleRows(first, rows).cwiseAbs().maxCoeff(); };
    const double all = std::max(largest(from), largest(to)), nothing = (b < 3 ? kNoColumn : 1) * all,
                 part = rtol_ + (b == 1 ? rounding.velocities : 0);
    for (Eigen::Index j = 0; j < e.cols(); ++j) {
      const double size = std::max({largest(from.col(j)), largest(to.col(j)), nothing, least_[k](b, j)});
      const double allowed = part * size + (b == 3 ? rounding.psi[j] : 0);
      if (allowed > 0) worst = std::max(worst, largest(e.col(j)) / allowed);
    }
  }
  return worst;
}

// A column is nothing where what it stands for, a change of its own by all of its size along a direction of its size,
// changes the motion by little, or psi by what it changes over the stretch at its end's rate.
void SlipSteps::set_least_sizes(double span, const VectorXd& x, const VectorXd& last, double end) {
  const auto& parameters = system_.assembly().parameters().parameters;
  Tangents at_end;
  system_.changes(end, last.data(), MatrixXd::Identity(N_, N_ + directions_.rows()), at_end);
  const Eigen::Index M = at_end[0].cols();
  VectorXd change = VectorXd::Ones(M), scale(M - N_), sizes = VectorXd::Zero(4);
  for (Eigen::Index j = 0; j < M - N_; ++j) scale[j] = parameters[static_cast<std::size_t>(j)].scale;
  change.tail(M - N_) = scale;
  for (int b = 0; b < 3; ++b) {
    const int first = blocks_.first[b], rows = blocks_.first[b + 1] - first;
    if (rows == 0) continue;
    const double size =
        std::max(x.segment(first, rows).cwiseAbs().maxCoeff(), last.segment(first, rows).cwiseAbs().maxCoeff());
    sizes[b] = kOfChange * size;
    if (size > 0) change.segment(first, rows).setConstant(size);
  }
  sizes[3] = span * at_end[0].row(N_).cwiseAbs().dot(change);
  for (std::size_t k = 0; k < at_end.size(); ++k) {
    const double of_direction =
        k == 0 ? 1 : directions_.col(static_cast<Eigen::Index>(k) - 1).cwiseQuotient(scale).cwiseAbs().maxCoeff();
    MatrixXd least = of_direction * sizes * change.cwiseInverse().transpose();
    least.row(3) = least.row(3).cwiseMax(span * at_end[k].row(N_).cwiseAbs().maxCoeff());
    least_.push_back(std::move(least));
  }
}

}  // namespace costate
