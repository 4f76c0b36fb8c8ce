// The forward state that SUNDIALS interpolates for the callbacks of a backward run, kept for further calls at the same
// time. Its interpolation (CVAfindIndex, IDAAfindIndex; 6.4 to 7) answers a call at exactly the first stored time from
// that point itself and takes note of having moved there, but keeps the divided differences of the interval that it
// came from; the next call at that time evaluates those and returns a state far from the trajectory. A backward run
// meets this where it ends, unless that is t = 0, and at every checkpoint.
#pragma once

#include <limits>
#include <vector>

namespace costate {

class ForwardState {
 public:
  const double* at(double t, const double* y, int size) {
    if (t != t_) {
      y_.assign(y, y + size);
      t_ = t;
    }
    return y_.data();
  }

  /// Of the last call, if there was one.
  double time() const { return t_; }
  const double* last() const { return y_.empty() ? nullptr : y_.data(); }

 private:
  double t_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> y_;
};

}  // namespace costate
