#include "costate/analysis/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "costate/base/error.h"

namespace costate {

namespace {

constexpr int kHalvings = 12;
constexpr double kLeap = 4;  // a change of this many times the last one's slope is a change of branch

class Continuation {
 public:
  Continuation(Assembly& assembly, double t, const std::vector<HeldPosition>& held, int coordinate)
      : assembly_(assembly), t_(t) {
    for (const auto& h : held)
      if (h.coordinate != coordinate) held_.push_back(h);
    held_.push_back({coordinate, 0});
  }

  const Equilibrium& at() const { return at_; }
  double value() const { return value_; }
  const std::string& complaint() const { return complaint_; }

  void begin(double value) {
    held_.back().value = value;
    at_ = find_equilibrium(assembly_, t_, held_, false);
    value_ = value;
  }

  /// Whether `target` was reached, in as many parts as it takes.
  bool lead_to(double target) {
    const double whole = target - value_;
    double step = whole;
    while (value_ != target) {
      // Steps of equal size, the last one onto the target.
      const bool last = std::abs(step) >= std::abs(target - value_) * (1 - 1e-12);
      if (advance(last ? target : value_ + step)) continue;
      step /= 2;
      if (std::abs(step) < std::abs(whole) * std::exp2(-kHalvings)) return false;
    }
    return true;
  }

 private:
  bool advance(double value) {
    const double step = value - value_;
    EquilibriumGuess guess{at_.q, at_.z};
    if (slope_) guess.q += step * *slope_;
    held_.back().value = value;
    try {
      Equilibrium next = find_equilibrium(assembly_, t_, held_, false, &guess);
      const Eigen::VectorXd slope = (next.q - at_.q) / step;
      if (slope_ && (slope - *slope_).norm() > kLeap * slope_->norm()) {
        complaint_ = "The next position lies on another branch.";
        return false;
      }
      slope_ = slope;
      at_ = std::move(next);
      value_ = value;
      return true;
    } catch (const ModelError& e) {
      complaint_ = e.bare_message();
      return false;
    }
  }

  Assembly& assembly_;
  const double t_;
  std::vector<HeldPosition> held_;
  Equilibrium at_;
  double value_ = 0;
  std::optional<Eigen::VectorXd> slope_;  // dq/dvalue of the last step
  std::string complaint_;
};

}  // namespace

Sweep sweep_position(Assembly& assembly, double t, const std::vector<HeldPosition>& held, int coordinate, double from,
                     double to, int count) {
  const auto& c = assembly.mechanism().coordinates()[static_cast<std::size_t>(coordinate)];
  Continuation path(assembly, t, held, coordinate);
  const double first = assembly.numbers()[static_cast<std::size_t>(c.position_number)];
  const double step = (to - from) / (count - 1);
  path.begin(first);
  // In steps like those of the sweep, but not endlessly many.
  const int parts = static_cast<int>(std::clamp(std::ceil(std::abs((from - first) / step)), 1.0, 1000.0));
  for (int k = 1; k <= parts && from != first; ++k)
    if (!path.lead_to(k == parts ? from : first + k * (from - first) / parts))
      throw ModelError("start",
                       fmt::format("The sweep cannot begin: '{}' goes from its first guess {:.6g} only to {:.6g} "
                                   "{}, not to {:.6g}. {}",
                                   c.name, first, path.value(), c.unit, from, path.complaint()));
  Sweep sweep;
  for (int k = 0; k < count; ++k) {
    const double value = std::lerp(from, to, static_cast<double>(k) / (count - 1));
    if (!path.lead_to(value)) {
      sweep.stopped = fmt::format("The mechanism locks: '{}' goes to {:.6g} {}, not to {:.6g}. {}", c.name,
                                  path.value(), c.unit, value, path.complaint());
      break;
    }
    sweep.points.push_back({value, path.at()});
  }
  sweep.reached = path.value();
  return sweep;
}

}  // namespace costate
