// A stop: { kind = "bump_stop", gap = -0.146, stiffness = 1e7, exponent = 1, smoothing = 1e-4 }. No force
// before the gap is closed, F = -stiffness d^exponent with d = gap - x beyond it (pushing, as a spring law);
// with side = "above" it is F = stiffness d^exponent with d = x - gap, a rebound stop that pulls.
//
// With a smoothing width w the depth d is replaced by a ramp r(d) that is 0 up to -w/2, d from w/2 on and w
// (s^3 - s^4/2), s = d/w + 1/2, between: twice continuously differentiable, too large by at most 3 w/32 (at d
// = 0). An exponent above 1 is continuously differentiable without it; an exponent of 1 has a kink and needs
// a width.
#pragma once

#include "costate/element/course.h"
#include "costate/kind/law/law_options.h"

namespace costate {

enum class StopSide { below, above };

/// Numbers: gap, stiffness, exponent, smoothing width.
class BumpStopLaw final : public ScalarLawOf<BumpStopLaw>, public PlacedLaw {
 public:
  explicit BumpStopLaw(StopSide side) : sign_(side == StopSide::below ? -1 : 1) {}
  int number_count() const override { return 4; }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    using std::exp;
    using std::log;
    const S depth = S(sign_) * (x - S(p[0])), width(p[3]);
    const double d = value_of(depth), w = value_of(width);
    if (d <= -0.5 * w) return S(0.0);
    S ramp = depth;
    if (d < 0.5 * w) {
      const S s = depth / width + S(0.5);
      if (!(value_of(s) > 0)) return S(0.0);
      ramp = width * s * s * s * (S(1.0) - S(0.5) * s);
      if (!(value_of(ramp) > 0)) return S(0.0);
    }
    return S(sign_) * S(p[1]) * exp(S(p[2]) * log(ramp));
  }
  void add_places(const double* p, LawPlaces& places) const override;
  double integral(double x, const double* p) const override;

 private:
  double sign_;
};

/// gap, the x where contact starts; stiffness [N/m^exponent]; exponent >= 1; smoothing width >= 0, more than
/// 0 where the exponent is 1. Throws ModelError otherwise.
LawOptions bump_stop_law(double gap, double stiffness, double exponent, double smoothing,
                         StopSide side = StopSide::below);

}  // namespace costate
