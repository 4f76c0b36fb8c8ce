// Shapes of roads as scalar laws: heights [m] over a distance [m]. As any law they also serve elsewhere.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "costate/element/course.h"
#include "costate/element/law/from_derivatives.h"
#include "costate/element/law/point_curve.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

inline constexpr double kTwoPi = 6.283185307179586476925;

/// `count` bumps, the first at start, each h (1 - cos(2 pi y / length)), or h sin(pi y / length), over its
/// own distance 0 <= y < length, one every `spacing`. Numbers: height, start, length, spacing (the last one
/// only of several bumps). The slope is continuous at the ends of the first shape, the curvature is not; the
/// second has kinks there.
class BumpLaw final : public ScalarLawOf<BumpLaw>, public PlacedLaw {
 public:
  BumpLaw(int count, bool half_sine) : count_(count), half_sine_(half_sine) {}
  int number_count() const override { return count_ > 1 ? 4 : 3; }
  void add_kinks(const double* p, std::vector<double>& x) const override {
    if (half_sine_) add_ends(p, x);
  }
  void add_curvature_jumps(const double* p, std::vector<double>& x) const override {
    if (!half_sine_) add_ends(p, x);
  }
  void add_place_slopes(double x, const double* p, double* slopes) const override;
  void add_places(const double* p, LawPlaces& places) const override;

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    using std::cos;
    using std::sin;
    S y = x - S(p[1]);
    const Place at = place(value_of(y), value_of(p[2]), count_ > 1 ? value_of(p[3]) : 0.0);
    if (!at.on) return S(0.0);
    if (at.bump > 0) y -= S(1.0 * at.bump) * S(p[3]);
    const S turn = y / S(p[2]);
    if (half_sine_) return S(p[0]) * sin(S(kTwoPi / 2) * turn);
    return S(p[0]) * (S(1.0) - cos(S(kTwoPi) * turn));
  }

 private:
  struct Place {
    int bump;  // the last one that began
    bool on;   // and is not over
  };
  Place place(double y, double length, double spacing) const;
  /// Where bumps begin and end.
  void add_ends(const double* p, std::vector<double>& x) const;

  int count_;
  bool half_sine_;
};

/// A sin(2 pi (n0 y + (n1 - n0) y^2 / (2 length))) from y = x - start = 0 on; beyond `length` the wave number
/// stays n1. Zero before, with a kink at the start unless n0 = 0. Numbers: amplitude, start, length, n0, n1
/// (wave numbers in 1/m).
class SineSweepLaw final : public ScalarLawOf<SineSweepLaw>, public PlacedLaw {
 public:
  int number_count() const override { return 5; }
  void add_kinks(const double* p, std::vector<double>& x) const override {
    if (p[3] != 0) x.push_back(p[1]);
  }
  void add_curvature_jumps(const double* p, std::vector<double>& x) const override {
    if (p[3] == 0) x.push_back(p[1]);
    x.push_back(p[1] + p[2]);
  }
  void add_place_slopes(double x, const double* p, double* slopes) const override;
  void add_places(const double* p, LawPlaces& places) const override;

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    using std::sin;
    const S y = x - S(p[1]), rise = S(p[4]) - S(p[3]);
    if (!(value_of(y) >= 0)) return S(0.0);
    // The place that add_curvature_jumps() tells, to the last bit.
    const S waves = value_of(x) < value_of(p[1]) + value_of(p[2]) ? (S(p[3]) + S(0.5) * rise * y / S(p[2])) * y
                                                                  : S(p[4]) * y - S(0.5) * rise * S(p[2]);
    return S(p[0]) * sin(S(kTwoPi) * waves);
  }
};

/// What a sum of sines is made of: n_i = n_min + (i + 1/2) dn, dn = (n_max - n_min) / count, with the power
/// spectral density G(n) = G0 (n / 0.1)^-exponent: A_i = sqrt(2 G(n_i) dn), phases uniform on the circle from
/// the seed.
struct SpectrumOptions {
  double exponent = 2;                 // 2: ISO 8608; 0: white
  double n_min = 0.011, n_max = 2.83;  // 1/m
  int count = 400;
  std::uint32_t seed = 1;
};

/// sum of A_i sin(2 pi n_i x + phi_i). Number: G0 = G(0.1 1/m) [m^3].
class SineSumLaw final : public ScalarLawOf<SineSumLaw>, public PlacedLaw {
 public:
  explicit SineSumLaw(const SpectrumOptions& options);
  int number_count() const override { return 1; }
  const SpectrumOptions& options() const { return options_; }
  double wave_number(int i) const { return options_.n_min + (i + 0.5) * spacing_; }
  /// A_i at G0 = 1.
  double unit_amplitude(int i) const { return amplitude_[static_cast<std::size_t>(i)]; }
  double phase(int i) const { return phase_[static_cast<std::size_t>(i)]; }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    using std::sqrt;
    double f[5];
    calc_sums(value_of(x), DerivativeOrder<S>::value, f);
    return S(sqrt(p[0])) * from_derivatives(x, f);
  }
  void add_places(const double* p, LawPlaces& places) const override;

 private:
  /// f[k], k <= order: the k-th derivative of the sum at G0 = 1, by rotating exp(2 pi i n_i x) from one i to
  /// the next.
  void calc_sums(double x, int order, double* f) const;

  SpectrumOptions options_;
  double spacing_;
  std::vector<double> amplitude_, phase_;
  // Padded to whole groups: A_i cos(phi_i) and A_i sin(phi_i), the factors of sin and cos, and 2 pi n_i.
  std::vector<double> sine_, cosine_, frequency_;
};

/// scale times the natural cubic spline through measured points, continued by its end tangents. Number:
/// scale. The points are data, not numbers, so that there may be many of them.
class ProfileTableLaw final : public ScalarLawOf<ProfileTableLaw>, public PlacedLaw {
 public:
  /// x strictly increasing, at least 2 points; throws ModelError otherwise.
  ProfileTableLaw(std::vector<double> x, std::vector<double> y);
  int number_count() const override { return 1; }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    double f[5];
    curve_.calc_derivatives(value_of(x), f);
    return S(p[0]) * from_derivatives(x, f);
  }
  void add_places(const double* p, LawPlaces& places) const override;

 private:
  PointCurve curve_;
};

}  // namespace costate
