// The bound on a step over a force that bends, where the run is differentiated: the error of such a step falls as the
// square of its length, that of its derivative only as the length, so the rates have a bound of their own.
#pragma once

#include <algorithm>
#include <cmath>

namespace costate {

/// Over the attempts at one step.
class BendBound {
 public:
  BendBound(double rtol, double error_order) : allowed_(std::max(kBend * rtol, finest(error_order))) {}

  /// StepEstimate::rate_error of an attempt, in units of what is allowed; 0 where shorter steps no longer make it less:
  /// that is rounding.
  double excess(double rate_error) {
    const double bend = rate_error / allowed_;
    same_ = bend >= 0.5 * least_ ? same_ + 1 : 0;
    least_ = std::min(least_, bend);
    return same_ < kSame ? bend : 0;
  }

 private:
  // Of the rates, in rtol; and the least that a scheme of low order gets to where forces are smooth.
  static constexpr double kBend = 10;
  static double finest(double error_order) { return error_order < 4 ? 1e-7 : error_order < 5 ? 1e-9 : 1e-11; }
  static constexpr int kSame = 3;

  double allowed_, least_ = HUGE_VAL;
  int same_ = 0;
};

}  // namespace costate
