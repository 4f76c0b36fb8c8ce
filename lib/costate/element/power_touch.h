// Forces that begin at a touch with a power of the depth, K d^n: between n = 1 and n = 2 their second derivative is
// infinite there.
#pragma once

namespace costate {

/// A force with gaps (element/gap_element.h) that begins so is one of these as well. Where its touches are no events
/// (guard_count() is zero), add_bends() gives its depths.
class PowerTouch {
 public:
  virtual ~PowerTouch() = default;
  /// n, of the element's numbers.
  virtual double touch_exponent(const double* p) const = 0;
};

}  // namespace costate
