// The top of a function of one variable between two places, by divisions of the golden section: one evaluation each,
// whatever the function's smoothness. A top is found to the square root of what its height is known to.
#pragma once

namespace costate {

/// Where the search stands: the interval, and the two places within it with the function's values there.
struct GoldenSection {
  double from, to;
  double low, f_low, high, f_high;

  double best() const { return f_low > f_high ? low : high; }
  double most() const { return f_low > f_high ? f_low : f_high; }
};

/// At most `divisions` of [from, to], as long as go_on(section).
template <class F, class GoOn>
GoldenSection golden_section(double from, double to, int divisions, const F& f, const GoOn& go_on) {
  constexpr double kPart = 0.6180339887498949;
  GoldenSection s{from, to, to - kPart * (to - from), 0, from + kPart * (to - from), 0};
  s.f_low = f(s.low);
  s.f_high = f(s.high);
  for (int k = 0; k < divisions && go_on(s); ++k)
    if (s.f_low > s.f_high) {
      s.to = s.high;
      s.high = s.low;
      s.f_high = s.f_low;
      s.low = s.to - kPart * (s.to - s.from);
      s.f_low = f(s.low);
    } else {
      s.from = s.low;
      s.low = s.high;
      s.f_low = s.f_high;
      s.high = s.from + kPart * (s.to - s.from);
      s.f_high = f(s.high);
    }
  return s;
}

}  // namespace costate
