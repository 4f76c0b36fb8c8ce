// Courses through levels by quintic steps h(s) = 10 s^3 - 15 s^4 + 6 s^5, level at both ends and twice
// continuously differentiable: lane changes, motions between stops.
//   { kind = "steps", at = [1, 4], values = [0, 3.5, 0], width = 2 }: from each at[k] on a step of the common
//   width; all of them are numbers, and steps that overlap add up.
//   { kind = "smooth_steps", x = [15, 45, 70, 95], y = [0, 3.5, 3.5, 0] }: from point to point, each step as
//   wide as the points are apart; the first and last level hold outside. The abscissae are fixed, the levels
//   are numbers.
#pragma once

#include <vector>

#include "costate/element/course.h"
#include "costate/kind/law/law_options.h"

namespace costate {

/// h(s), 0 <= s <= 1, and its integral from 0.
template <class S>
S quintic_step(const S& s) {
  return s * s * s * (S(10.0) - S(15.0) * s + S(6.0) * s * s);
}
inline double quintic_step_integral(double s) { return s * s * s * s * (2.5 - 3 * s + s * s); }

/// Numbers: the width, the n places, the n + 1 values.
class StepsLaw final : public ScalarLawOf<StepsLaw>, public PlacedLaw {
 public:
  explicit StepsLaw(int steps) : n_(steps) {}
  int number_count() const override { return 2 * n_ + 2; }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    const P *at = p + 1, *y = p + 1 + n_;
    S sum = S(y[0]);
    for (int k = 0; k < n_; ++k) {
      if (value_of(x) < value_of(at[k])) continue;
      const S rise = S(y[k + 1]) - S(y[k]), s = (x - S(at[k])) / S(p[0]);
      // The place that add_third_jumps() tells, to the last bit.
      sum += value_of(x) >= value_of(at[k]) + value_of(p[0]) ? rise : rise * quintic_step(s);
    }
    return sum;
  }
  void add_places(const double* p, LawPlaces& places) const override;
  void add_third_jumps(const double* p, std::vector<double>& x) const override;
  void add_place_slopes(double x, const double* p, double* slopes) const override;
  /// Exact: step by step.
  double integral(double x, const double* p) const override { return primitive(x, p) - primitive(0, p); }

 private:
  double primitive(double x, const double* p) const {
    const double *at = p + 1, *y = p + 1 + n_;
    double sum = y[0] * x;
    for (int k = 0; k < n_; ++k) {
      const double s = (x - at[k]) / p[0];
      if (s <= 0) continue;
      sum += (y[k + 1] - y[k]) * p[0] * (s < 1 ? quintic_step_integral(s) : s - 0.5);
    }
    return sum;
  }

  int n_;
};

/// Between neighbouring points y_k + (y_k+1 - y_k) h((x - x_k) / (x_k+1 - x_k)). Numbers: the levels y.
class SmoothStepsLaw final : public ScalarLawOf<SmoothStepsLaw>, public PlacedLaw {
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
    return S(p[k]) + (S(p[k + 1]) - S(p[k])) * quintic_step(s);
  }

  void add_places(const double* p, LawPlaces& places) const override;
  /// Exact: interval by interval.
  double integral(double x, const double* p) const override { return primitive(x, p) - primitive(0, p); }

 private:
  /// The integral from the first place.
  double primitive(double x, const double* p) const;

  std::vector<double> x_;
};

/// values[0], then by a step of `width` from each at[k] on to values[k + 1].
LawOptions steps_law(const std::vector<double>& at, const std::vector<double>& values, double width);
LawOptions smooth_steps_law(std::vector<double> x, const std::vector<double>& y);

}  // namespace costate
