#include "costate/event/end_event.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/golden_section.h"
#include "costate/event/step_motion.h"

namespace costate {

namespace {

// Looks within a step that may hold the end, in each part of it in which what the output depends on turns by a radian.
constexpr int kEndLooks = 8, kMostEndParts = 1024;
// Divisions by the golden section: a top is found to (0.618^30)^2 of its height, some 1e-13 of a step's change.
constexpr int kTopDivisions = 30;
// A step is looked into when the level is within this many of its changes and of those of the step before.
constexpr double kNearChanges = 2;
// A step that ends this near the level, of the output's range, and rising, ends at it: where an event of the motion
// comes with the level (a contact's gap that is the output) rounding would decide between them.
constexpr double kAtLevel = 1e-12;
// An output that rests at the level (a speed, of what sticks) is on neither side of it, but for rounding and drift.
constexpr double kRests = 1e-7;
// An output whose values on both sides of one instant are apart by this part of its range jumps.
constexpr double kEndJump = 1e-6;

class EndTerm final : public CostTerm {
 public:
  EndTerm(EndEvent end, double kappa) : end_(std::move(end)), kappa_(kappa) {}
  double value(const StateView& s, Assembly& assembly) const override {
    return kappa_ * (end_.output->value(s, assembly) - end_.level_in(assembly));
  }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    end_.add_gradient(s, assembly, factor * kappa_, g);
  }
  bool needs_accelerations() const override { return end_.output->needs_accelerations(); }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                           ScalarGradient& g) const override {
    end_.output->add_gradient_change(s, assembly, d, kappa_, g);
  }
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override {
    return kappa_ * end_.change(s, assembly, d);
  }

 private:
  EndEvent end_;
  double kappa_;
};

}  // namespace

double EndEvent::level_in(const Assembly& assembly) const {
  return level_number < 0 ? level : assembly.numbers()[static_cast<std::size_t>(level_number)];
}

double EndEvent::change(const StateView& s, Assembly& assembly, const Variation& d) const {
  return output->change(s, assembly, d) - (level_number < 0 ? 0 : d.numbers[level_number]);
}

void EndEvent::add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const {
  output->add_gradient(s, assembly, factor, g);
  if (level_number >= 0) g.add_number(assembly, level_number, -factor);
}

double EndEvent::distance(const StateView& s, Assembly& assembly) const {
  const double h = output->value(s, assembly) - level_in(assembly);
  return above ? h : -h;
}

std::string EndEvent::text(const Assembly& assembly) const {
  return fmt::format("'{}' {} {:g} {}", output->name(), above ? "above" : "below", level_in(assembly), output->unit());
}

std::shared_ptr<const CostTerm> end_term(const EndEvent& end, double kappa) {
  return std::make_shared<EndTerm>(end, kappa);
}

Variation along_motion(const StateView& s, Assembly& assembly, const std::vector<double>& no_change,
                       const Eigen::VectorXd& rates) {
  assembly.calc_dynamics(s);
  Variation motion;
  motion.t = 1;
  motion.q = s.v;
  motion.v = s.a;
  if (rates.size() > 0) {
    motion.a = rates.data();
    motion.lambda = rates.data() + assembly.n();
  }
  motion.z = assembly.zdot.data();
  motion.numbers = no_change.data();
  return motion;
}

double end_rate(const EndEvent& end, const StateView& s, Assembly& assembly, const Eigen::VectorXd& rates) {
  const std::vector<double> no_change(assembly.numbers().size(), 0.0);
  return end.output->change(s, assembly, along_motion(s, assembly, no_change, rates));
}

EndRates end_rates(const EndEvent& end, const Objective& objective, const StateView& s, Assembly& assembly,
                   const Eigen::VectorXd& rates) {
  const std::vector<double> no_change(assembly.numbers().size(), 0.0);
  const Variation motion = along_motion(s, assembly, no_change, rates);
  EndRates r;
  r.h_rate = end.output->change(s, assembly, motion);
  double psi_rate = objective.running_value(s, assembly);
  for (const auto& term : objective.terminal) psi_rate += term->change(s, assembly, motion);
  r.kappa = -psi_rate / r.h_rate;
  return r;
}

void EndSearch::note(double t, double h) {
  if (std::isnan(h)) return;  // a guard that is not looked at
  if (std::isnan(largest_)) largest_ = smallest_ = h;
  if (h < -kRests * range()) armed_ = true;
  // Before it has been on its own side the output comes near from the wrong one, and leaves the level behind it.
  const bool leaves = largest_ > 0 && !(h > h_before_ + kRests * range());
  if (armed_ && !leaves && std::abs(h) < nearest_) {
    nearest_ = std::abs(h);
    nearest_time_ = t;
  }
  // A step that leads past the end tells nothing of the run.
  if (!armed_ || h <= 0) largest_ = std::max(largest_, h);
  smallest_ = std::min(smallest_, h);
}

double EndSearch::turning_speed_of(const StateView& s, const Assembly& assembly) const {
  return turning_speed(assembly.mechanism(), depends_on_ ? &*depends_on_ : nullptr, s.v);
}

void EndSearch::begin(const StateView& s, Assembly& assembly) {
  turning_ = turning_speed_of(s, assembly);
  h_ = largest_ = smallest_ = end_.distance(s, assembly);
  nearest_ = std::numeric_limits<double>::infinity();
  t_ = nearest_time_ = t_start_;
  note(t_, h_);
}

bool EndSearch::step(const StateView& s, Assembly& assembly) {
  const double change = change_;
  t_before_ = t_;
  h_before_ = h_;
  t_ = s.t;
  h_ = end_.distance(s, assembly);
  change_ = std::abs(h_ - h_before_);
  const double turning = turning_speed_of(s, assembly);
  turn_ = std::max(turning_, turning) * (t_ - t_before_);
  turning_ = turning;
  const bool armed = armed_;
  note(t_, h_);
  if (armed && (h_ >= 0 || ends_at_level())) return true;
  if (++steps_ <= 2 || turn_ > 1) return true;  // nothing is known of its course
  return -std::max(h_, h_before_) <= kNearChanges * (change_ + change);
}

bool EndSearch::ends_at_level() const { return h_ > h_before_ && h_ >= -kAtLevel * range(); }

std::optional<double> EndSearch::find(const std::function<double(double)>& distance) {
  struct Point {
    double t, h;
  };
  const auto at = [&](double t) {
    const Point p{t, t == t_ ? h_ : distance(t)};
    note(t, p.h);
    return p;
  };
  const auto jumps = [&](const Point& from, const Point& to) -> SolverError {
    return SolverError(fmt::format(
        "At t = {:.9g} s the output '{}' jumps across the level of 'ends_when', or of the section of a cycle: right "
        "before it is {:.6g} {} short of the level, right behind {:.6g} beyond it. Runs end where an output comes to a "
        "level, and this end would have "
        "no derivative. Take an output that is continuous there.",
        to.t, end_.output->name(), std::abs(from.h), end_.output->unit(), std::abs(to.h)));
  };
  // From before the level to behind it: by halves and secants to the last bit.
  const auto cross = [&](Point a, Point b) {
    for (int k = 0; k < 200 && b.t - a.t > 2 * std::numeric_limits<double>::epsilon() * std::abs(b.t); ++k) {
      double m = k % 3 == 2 || !(b.h > a.h) ? 0.5 * (a.t + b.t) : a.t + (b.t - a.t) * (-a.h / (b.h - a.h));
      const double inward = 1e-9 * (b.t - a.t);
      if (!(m > a.t + inward) || !(m < b.t - inward)) m = 0.5 * (a.t + b.t);
      if (m <= a.t || m >= b.t) break;
      const Point p{m, distance(m)};
      (p.h < 0 ? a : b) = p;
    }
    if (b.h - a.h > kEndJump * range()) throw jumps(a, b);
    return b.t;
  };
  // Where a segment of the motion begins velocities may have jumped.
  std::vector<Point> looks = {at(std::nextafter(t_before_, t_))};
  if (armed_ && h_before_ < 0 && looks[0].h >= 0) {
    if (looks[0].h - h_before_ > kEndJump * range()) throw jumps({t_before_, h_before_}, looks[0]);
    return looks[0].t;
  }
  double change = 0;
  const int count = kEndLooks * static_cast<int>(std::ceil(std::clamp(turn_, 1.0, 1.0 * kMostEndParts)));
  for (int j = 1; j <= count; ++j) {
    looks.push_back(at(j == count ? t_ : t_before_ + (t_ - t_before_) * j / count));
    change = std::max(change, std::abs(looks.back().h - looks[looks.size() - 2].h));
    if (looks.back().h >= 0) break;
  }
  // A short visit between two looks: the top of one that is higher than its neighbours, by the golden section.
  const auto visit = [&](const Point& a, const Point& b) -> std::optional<double> {
    const GoldenSection top = golden_section(
        a.t, b.t, kTopDivisions, [&](double t) { return at(t).h; },
        [](const GoldenSection& g) { return g.f_low < 0 && g.f_high < 0; });
    if (top.most() < 0) return {};
    return cross(at(top.from), at(top.f_low >= 0 ? top.low : top.high));
  };
  const std::size_t last = looks.size() - 1;
  for (std::size_t k = 0; k <= last && looks[k].h < 0; ++k) {
    const Point &before = looks[k > 0 ? k - 1 : 0], &after = looks[std::min(k + 1, last)];
    if (after.h >= 0 && !armed_) continue;
    if (after.h >= 0) return cross(looks[k], after);
    if (before.h > looks[k].h || after.h > looks[k].h || -looks[k].h > change) continue;
    if (const auto found = visit(before, after)) return found;
  }
  if (armed_ && ends_at_level()) return t_;
  return {};
}

}  // namespace costate
