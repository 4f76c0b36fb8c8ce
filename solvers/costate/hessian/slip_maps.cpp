#include "costate/hessian/slip_maps.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "costate/assembly/packed_state.h"
#include "costate/base/error.h"
#include "costate/discrete/radau_scheme.h"

namespace costate {

namespace {
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Tangents = std::vector<MatrixXd>;

constexpr double kForever = std::numeric_limits<double>::infinity();
// Of the largest speed since the last event or until the next one: what is faster is not slow.
constexpr double kNoLongerSlow = 1e-2;
// Of the run's tolerance; and of |w|, the error of velocities in a step.
constexpr double kSharper = 0.1, kSharpest = 1e-10, kOfSpeed = 0.1;
// Of the stretch the first step, from rest and otherwise; of an error's size what a column has that is nothing.
constexpr double kFirstStep = 1e-6, kFirstOfMany = 0.05, kNothing = 1e-6;
constexpr double kSafety = 0.9, kGrowth = 5, kCut = 0.2;
constexpr int kMostSteps = 600, kMostIterations = 12;
constexpr double kRounding = 1e-13;

/// Steps of (x; S and its changes) from where a slip begins.
class Steps {
 public:
  Steps(SecondTangents& system, TangentMotion& motion, double rtol)
      : system_(system), motion_(motion), scheme_(*find_radau_scheme("radau9")), rtol_(rtol), N_(system.state_size()) {}

  /// `last`: x at the end, about.
  void run(double t, double end, VectorXd& x, Tangents& tangents, const VectorXd& last) {
    double h = (slip(t, x) < slip(end, last) ? kFirstStep : kFirstOfMany) * (end - t);
    system_.changes(end, last.data(), MatrixXd::Identity(N_, tangents[0].cols()), psi_);
    for (MatrixXd& of : psi_) of *= end - t;
    const double begin = t;
    speed_ = slip(t, x);
    evaluate(t, x, tangents, begin_);
    for (steps_ = 0; t < end; ++steps_) {
      if (steps_ > kMostSteps || !(t + h > t))
        throw CapabilityError(
            fmt::format("A slip in space at t = {:.9g} s is slow for so long that second derivatives do not follow it: "
                        "{} steps come to t = {:.9g} s. Differences of gradients tell them.",
                        begin, steps_, t));
      const bool ends = h >= end - t;
      if (ends) h = end - t;
      const double taken = h, error = attempt(t, h, x, tangents);
      const double factor = error > 0 ? kSafety * std::pow(error, -1.0 / (scheme_.stages + 1)) : kGrowth;
      h *= std::clamp(factor, kCut, error <= 1 ? kGrowth : 0.9);
      if (error > 1) continue;
      t = ends ? end : t + taken;
      x = x_after_;
      tangents = after_;
      std::swap(begin_, end_);
      const double before = std::exchange(speed_, slip(t, x));
      h *= std::min(1.0, speed_ / before);  // on the way to a stop steps are as what is left of it
    }
  }
  long steps() const { return steps_; }
  long factorizations() const { return factorizations_; }

 private:
  /// A point of the way: x', the equations' blocks (SecondTangents::changes()), and the tangents' rates.
  struct Point {
    VectorXd f;
    Tangents of, rates;
  };
  void evaluate(double t, const VectorXd& x, const Tangents& tangents, Point& at) {
    MatrixXd A;
    system_.rates(t, x.data(), at.f, A);
    system_.changes(t, x.data(), tangents[0], at.of);
    at.rates = system_.tangent_rates(at.of, tangents);
  }
  /// x and the tangents behind the step of h; its error in tolerances, infinite where it has no solution.
  double attempt(double t, double h, const VectorXd& x, const Tangents& tangents) {
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
    double last = kForever;
    for (int iteration = 0;; ++iteration) {
      if (iteration == kMostIterations) return kForever;
      for (int i = 0; i < s; ++i) system_.rates(scheme_.time(i, t, h, t + h), at(X, i).data(), at(f, i), at(A, i));
      factor();
      VectorXd left(s * N_);
      for (int i = 0; i < s; ++i) {
        left.segment(i * N_, N_) = x - at(X, i);
        for (int j = 0; j < s; ++j) left.segment(i * N_, N_) += h * a(i, j) * at(f, j);
      }
      const VectorXd change = lu.solve(left);
      if (!change.allFinite()) return kForever;
      double size = 0;
      for (int i = 0; i < s; ++i) {
        at(X, i) += change.segment(i * N_, N_);
        size = std::max(size, measure(change.segment(i * N_, N_), x));
      }
      if (size > 2 * last) return kForever;
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
      for (int i = 0; i < s; ++i) rates.push_back(system_.tangent_rates(at(of, i), at(stage, i)));
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

  double error(double h, const VectorXd& x, const Tangents& tangents, const std::vector<VectorXd>& f,
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
    for (std::size_t k = 0; k < tangents.size(); ++k) {
      MatrixXd e_k = h * scheme_.error[0] * begin_.rates[k];
      for (std::size_t i = 0; i < rates.size(); ++i) e_k += h * scheme_.error[i + 1] * rates[i][k];
      worst = std::max(worst,
                       measure_tangents(filtered(e_k), tangents[k], after_[k], psi_[k].row(N_).cwiseAbs().maxCoeff()));
    }
    const double allowed = scheme_.estimate_factor(rtol_);
    return std::isfinite(worst) ? worst / allowed : kForever;
  }

  /// In tolerances: of positions, of velocities by what the slip has, of states.
  double measure(const VectorXd& e, const VectorXd& x) const {
    const int n = motion_.assembly().n();
    const auto part = [&](int first, int count, double size) {
      return count == 0 ? 0.0 : e.segment(first, count).cwiseAbs().maxCoeff() / (rtol_ * size);
    };
    const double rounding = 1e-4 * x.cwiseAbs().maxCoeff();
    return std::max({part(0, n, std::max(1e-3, x.head(n).cwiseAbs().maxCoeff())),
                     part(n, n, kOfSpeed * speed_ + kRounding * x.segment(n, n).cwiseAbs().maxCoeff() / rtol_),
                     part(2 * n, N_ - 2 * n, 1 + rounding)});
  }
  /// Each column by its own blocks of positions, velocities, states and psi, in units of its size; psi's is at least
  /// this.
  double measure_tangents(const MatrixXd& e, const MatrixXd& from, const MatrixXd& to, double psi) const {
    const int n = motion_.assembly().n();
    const int first[] = {0, n, 2 * n, N_, N_ + 1};
    double worst = 0;
    for (int b = 0; b < 4; ++b) {
      const int rows = first[b + 1] - first[b];
      if (rows == 0) continue;
      const double all = std::max(from.middleRows(first[b], rows).cwiseAbs().maxCoeff(),
                                  to.middleRows(first[b], rows).cwiseAbs().maxCoeff());
      const double least = b < 3 ? kNothing * all : std::max(all, psi);
      if (least == 0) continue;
      for (Eigen::Index j = 0; j < e.cols(); ++j) {
        const double size = std::max(from.col(j).segment(first[b], rows).cwiseAbs().maxCoeff(),
                                     to.col(j).segment(first[b], rows).cwiseAbs().maxCoeff());
        worst =
            std::max(worst, e.col(j).segment(first[b], rows).cwiseAbs().maxCoeff() / (rtol_ * std::max(size, least)));
      }
    }
    return worst;
  }
  double slip(double t, const VectorXd& x) {
    return motion_.slowest_in_space(packed_view(t, x.data(), motion_.assembly().n())).speed;
  }

  SecondTangents& system_;
  TangentMotion& motion_;
  const RadauScheme& scheme_;
  double rtol_;
  int N_;
  long steps_ = 0, factorizations_ = 0;
  double speed_ = 0;   // |w| where the step begins
  Point begin_, end_;  // of the step
  VectorXd x_after_;
  Tangents after_, psi_;  // psi_: what its rates come to
};

/// The slowest |w| at the ends of steps, in order.
using Speeds = std::vector<std::pair<double, double>>;

Speeds speeds_between(double from, double to, TangentMotion& forward, const Trajectory& motion) {
  Speeds speeds;
  std::vector<double> y(static_cast<std::size_t>(motion.width()));
  for (std::size_t i = 0; i < motion.steps() && motion.step_end(i) < to; ++i) {
    const double t = motion.step_end(i);
    if (t <= from) continue;
    motion.evaluate(t, y.data());
    speeds.emplace_back(t, forward.slowest_in_space(forward.look_state(t, y.data())).speed);
  }
  return speeds;
}
}  // namespace

std::vector<SlipMap> find_slip_maps(const Problem& problem, HessianEquations& equations, TangentMotion& forward,
                                    const Trajectory& motion, const std::vector<HessianEquations::Bend>& bends,
                                    std::vector<HessianEquations::Event>& events) {
  std::vector<SlipMap> all;
  if (!forward.may_slip_in_space()) return all;
  std::vector<double> places{motion.t_begin(), motion.t_end()};  // between which a stretch lies
  for (const auto& event : events) places.push_back(event.t);
  for (const auto& bend : bends) places.insert(places.end(), {bend.before, bend.after});
  std::sort(places.begin(), places.end());
  const double rtol = std::max(kSharpest, kSharper * problem.solver.rtol);
  const auto state_at = [&](double t) {
    std::vector<double> y(static_cast<std::size_t>(motion.width()));
    motion.evaluate(t, y.data());
    return y;
  };
  // Returns (x, tangents along the directions) at the end.
  const auto follow = [&](SlipMap& slip, const std::vector<double>& from, const auto& begin) {
    SecondTangents system(equations, problem.objective);
    Steps steps(system, forward, rtol);
    const auto x_of = [&](const std::vector<double>& y) {
      return VectorXd(Eigen::Map<const VectorXd>(y.data(), system.state_size()));
    };
    VectorXd x = x_of(from);
    Tangents tangents = begin(system);
    steps.run(slip.begin, slip.end, x, tangents, x_of(state_at(slip.end)));
    slip.map = system.map(tangents);
    slip.counters.steps = steps.steps();
    slip.counters.factorizations = steps.factorizations();
    all.push_back(std::move(slip));
    std::vector<double> y(x.data(), x.data() + x.size());
    const MatrixXd moved = system.along(tangents[0]);
    y.insert(y.end(), moved.data(), moved.data() + moved.size());
    return y;
  };
  for (HessianEquations::Event& event : events) {
    const bool begins = forward.begins_from_rest(event);
    if (!begins && !forward.stops_slip(event)) continue;
    SlipMap slip{event.t, event.t, event.t, begins};
    const auto here = std::lower_bound(places.begin(), places.end(), event.t);
    double from = begins ? event.t : *std::prev(here),
           to = begins ? *std::upper_bound(here, places.end(), event.t) : event.t;
    if (!all.empty()) from = std::max(from, all.back().end);
    const Speeds speeds = speeds_between(from, to, forward, motion);
    double largest = 0;
    for (const auto& [t, speed] : speeds) largest = std::max(largest, speed);
    const auto fast = [&](const auto& at) { return at.second > kNoLongerSlow * largest; };
    if (begins) {
      const auto end = std::find_if(speeds.begin(), speeds.end(), fast);
      slip.end = end != speeds.end() ? end->first : 0.5 * (from + to);
      const VectorXd shifts = equations.bend_shifts(forward.jumps(), event);
      follow(slip, event.after, [&](SecondTangents& system) { return system.begin(event, shifts); });
    } else {
      const auto begin = std::find_if(speeds.rbegin(), speeds.rend(), fast);
      if (begin == speeds.rend()) continue;
      slip.begin = begin->first;
      const std::vector<double> y = state_at(slip.begin);
      try {
        // What is stored tells the direction to e/|w|.
        event.before = event.state_before = follow(slip, y, [&](SecondTangents& system) { return system.begin(y); });
        event.near_before = event.t;
      } catch (const CapabilityError&) {
        continue;  // as well as what is stored tells it
      }
    }
  }
  return all;
}

}  // namespace costate
