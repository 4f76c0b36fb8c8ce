// A course through levels: { kind = "smooth_steps", x = [15, 45, 70, 95], y = [0, 3.5, 3.5, 0] }. Between neighbouring
// points the quintic y_k + (y_k+1 - y_k) (10 s^3 - 15 s^4 + 6 s^5), s = (x - x_k) / (x_k+1 - x_k), level at both ends;
// the first and last level hold outside. Twice continuously differentiable: lane changes, motions between stops.
// The abscissae are fixed, the levels are numbers.
#pragma once

#include <vector>

#include "costate/element/kind/law_options.h"

namespace costate {

class SmoothStepsLaw final : public ScalarLawOf<SmoothStepsLaw> {
 public:
  /// x strictly increasing, at least 2 entries; throws ModelError otherwise.
  explicit SmoothStepsLaw(std::vector<double> x);
  int number_count() const override { return static_cast<int>(x_.size()); }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    const double at = value_of(x);
    const int n = number_count();
    if (at <= x_.front()) return S(p[0]);
    if (at >= x_.back()) return S(p[n - 1]);
    int k = 0;
    while (x_[k + 1] < at) ++k;
    const S s = (x - S(x_[k])) * S(1 / (x_[k + 1] - x_[k]));
    return S(p[k]) + (S(p[k + 1]) - S(p[k])) * s * s * s * (S(10.0) - S(15.0) * s + S(6.0) * s * s);
  }

  /// Exact: interval by interval.
  double integral(double x, const double* p) const override { return primitive(x, p) - primitive(0, p); }

 private:
  /// The integral from the first place.
  double primitive(double x, const double* p) const;

  std::vector<double> x_;
};

LawOptions smooth_steps_law(std::vector<double> x, const std::vector<double>& y);

}  // namespace costate
