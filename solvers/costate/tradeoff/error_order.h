// What differences of runs at falling tolerances tell of the error of the last one.
//
// With d = |R(a r) - R(r)| and errors of the order r^p, the error of R(r) is about d / (a^p - 1). Of a tolerance that
// bounds local errors p is near 1; without having seen it fall 0.5 is taken, of an explicit scheme's steps 0.7, and
// 0.7 at most where it has been seen. 0.3 where errors are far above the tolerances, and 0.5 once they have been seen
// to fall twice: what makes them is not the steps' own errors then, but what a motion makes of them (over stick and
// slip, say), which falls by fits and starts. And no more is counted on than what tolerances a = 30 apart make: two
// runs that differ little may do so by chance.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace costate {

class ErrorOrder {
 public:
  static constexpr double kApart = 30;

  explicit ErrorOrder(bool scheme) : p_(scheme ? kUsual : kSafe) {}

  /// Two runs at these tolerances are so far apart.
  void look(double looser, double rtol, double apart) {
    const bool erratic = apart > kAbove * looser;
    // A difference is about the error of the looser run.
    if (apart_ > 0 && apart > 0 && looser < looser_) {
      const double seen = std::log(apart_ / apart) / std::log(looser_ / looser) - kLess;
      falls_ = seen >= kSafe ? falls_ + 1 : 0;
      slow_ = seen < kSafe;
      p_ = std::clamp(seen, kErratic, !erratic ? kUsual : falls_ > 1 ? kSafe : kErratic);
    } else if (erratic) {
      p_ = kErratic;
    }
    looser_ = looser;
    ratio_ = looser / rtol;
    apart_ = apart;
  }
  /// The last difference has fallen against the one before by less than the safe order.
  bool slow() const { return slow_; }
  /// Of the last difference: the error of its tighter run.
  double share() const { return share(std::min(ratio_, kApart)); }
  /// The next tolerance against the last one, so that an error of `aim` is to be expected by share(); or, where that is
  /// too far for one step, one from which the next step gets there.
  double step(double aim) const {
    const double error = std::min(kMargin / ratio_, share()) * apart_, reach = aim / share(kApart),
                 ratio = error > reach ? error / (kWithin * reach) : std::pow(1 + error / aim, 1 / p_);
    return std::clamp(1 / ratio, kLargestStep, kSmallestStep);
  }

 private:
  double share(double ratio) const { return 1 / (std::pow(ratio, p_) - 1); }

  static constexpr double kErratic = 0.3, kSafe = 0.5, kUsual = 0.7, kLess = 0.1, kAbove = 10;
  // Errors are not expected to fall quite with the tolerance, and the next step is to begin well within reach; the
  // bounds of a step.
  static constexpr double kMargin = 2, kWithin = 0.5, kSmallestStep = 0.1, kLargestStep = 1e-4;
  int falls_ = 0;  // so many times in a row
  bool slow_ = false;
  double p_, looser_ = 0, ratio_ = 10, apart_ = 0;
};

/// What the runs before the last two tell: errors are not counted on to fall faster than with r^0.7, so that a
/// difference which has done so is small by chance. Of several quantities at once.
class FastestFall {
 public:
  /// Two runs at these tolerances are so far apart.
  void look(double looser, double rtol, std::vector<double> apart) {
    least_.assign(apart.size(), 0);
    for (std::size_t i = 0; i < apart_.size(); ++i) least_[i] = apart_[i] * std::pow(rtol / looser_, kFastest);
    looser_ = looser;
    apart_ = std::move(apart);
  }
  /// The least error of the tighter run.
  double least(std::size_t i) const { return least_[i]; }

 private:
  static constexpr double kFastest = 0.7;
  double looser_ = 0;
  std::vector<double> apart_, least_;
};

}  // namespace costate
