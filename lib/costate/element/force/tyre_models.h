// Tyre models: what a tyre does for a normal force F_n, the velocity of its contact along e_x and e_g (tyre_contact.h),
// the camber and the wheel's rolling speed. A model is one templated function object that says which outputs
// it has; the contact (tyre_contact.h) and the wheel's motion (tyre_force.h) are shared, and derivatives come
// from dual numbers over these few inputs.
#pragma once

#include <algorithm>
#include <cmath>

#include "costate/derivative/dual.h"
#include "costate/element/jumping_force.h"

namespace costate {

/// The inputs; a model uses the first `inputs` of them and its states.
template <class S>
struct TyreInput {
  static constexpr int most = 5;
  S x[most]{};
  const S& normal() const { return x[0]; }   // F_n, N
  const S& forward() const { return x[1]; }  // V_c.e_x, m/s
  const S& lateral() const { return x[2]; }  // V_c.e_g, m/s
  const S& camber() const { return x[3]; }   // rad
  const S& rolling() const { return x[4]; }  // spin times the effective radius, m/s, positive forward
};

/// The outputs at the contact point: forces along e_x and e_g, moments about e_x, e_y and n.
template <class S>
struct TyreOutput {
  static constexpr int count = 5;
  S x[count]{};
  S& longitudinal() { return x[0]; }  // N
  S& lateral() { return x[1]; }       // N
  S& overturning() { return x[2]; }   // N m, about e_x
  S& rolling() { return x[3]; }       // N m, about e_y
  S& aligning() { return x[4]; }      // N m, about n
};

/// x coth(x): |x| away from 0, to 2 |x| exp(-2 |x|), and 1 + x^2/3 near 0.
template <class S>
S x_coth(const S& x) {
  using std::tanh;
  if (std::abs(value_of(x)) > 0.1) return x / tanh(x);
  const S y = x * x;  // the next term is 2e-6 x^12
  return S(1.0) + y * (S(1.0 / 3) - y * (S(1.0 / 45) - y * (S(2.0 / 945) - y * (S(1.0 / 4725) - y * S(2.0 / 93555)))));
}

/// How slip follows from velocities. Numbers: [slip speed w], then where the tyre lags [relaxation length,
/// initial value].
///   at once        tan alpha = V.e_g / s,  s = V.e_x coth(V.e_x / w): |V.e_x| to a fraction 2 exp(-2 |V.e_x|
///   / w), 4e-9
///                  from 10 w on, and w at rest, so that slip is regular there
///   w = 0          tan alpha = V.e_g / |V.e_x|, but 0 up to 0.1 m/s and in a skid without forward speed: as
///   the public
///                  Iltis model does
///   with a lag     tan alpha = z, L z' = V.e_g - s z: regular also for w = 0; at rest the tyre is then a
///   spring
struct TyreSlip {
  bool lags = false;
  static constexpr double cut_speed = 0.1;  // m/s
  int number_count() const { return lags ? 3 : 1; }

  template <class S, class P>
  static S speed(const S& forward, const P& w) {
    if (value_of(w) == 0) return value_of(forward) < 0 ? -forward : forward;
    return S(w) * x_coth(forward / S(w));
  }
  /// tanh(V.e_x / w), V.e_x / s (w = 0: by 0.1 m/s): which end of the patch is behind, forward 1, in reverse -1.
  template <class S, class P>
  static S direction(const S& forward, const P& w) {
    using std::tanh;
    return tanh(forward / (value_of(w) == 0 ? S(cut_speed) : S(w)));
  }
  /// sliding / speed: both slips that do not lag.
  template <class S, class P>
  static S ratio(const S& forward, const S& sliding, const P& w) {
    if (value_of(w) == 0) {
      const double u = value_of(forward), v = value_of(sliding);
      if (!(u * u + v * v > cut_speed * cut_speed) || !(std::abs(u) > 1e-9)) return S(0.0);
    }
    return sliding / speed(forward, w);
  }
  template <class S, class P>
  S tangent(const S& forward, const S& lateral, const S* z, const P* p) const {
    return lags ? z[0] : ratio(forward, lateral, p[0]);
  }
  /// Where slip is cut; `side(forward)` is the side force with that speed along.
  template <class Side>
  void add_jump_places(double forward, double lateral, const double* p, const Side& side,
                       std::vector<JumpPlace>& places) const {
    if (lags || p[0] != 0) return;
    const double speed = std::hypot(forward, lateral), at = cut_speed / std::max(speed, 1e-3 * cut_speed);
    places.push_back({speed - cut_speed, 0, std::abs(side(1.001 * at) - side(0.999 * at)),
                      "passes the speed of 0.1 m/s up to which slip_speed_m_per_s = 0 takes slip for none",
                      "Give a slip_speed_m_per_s (0.1), or a relaxation_length_m"});
  }
  template <class S, class P>
  void rate(const S& forward, const S& lateral, const S* z, const P* p, S* zdot) const {
    if (lags) zdot[0] = (lateral - speed(forward, p[0]) * z[0]) / S(p[1]);
  }
};

/// Normal force alone: for rigs and ride, where slip would be singular or is not asked for.
struct RideTyre {
  static constexpr int inputs = 1, most_states = 0;
  static constexpr bool slips = false, pulls_along = false, overturns = false, resists = false;
  static constexpr int most_numbers = 0;
  int number_count() const { return 0; }
  int states() const { return 0; }
  int initial_state(int) const { return -1; }
  int trail() const { return -1; }
  template <class S, class P>
  void operator()(const TyreInput<S>&, const S*, const P*, TyreOutput<S>&, S*) const {}
  template <class S, class P>
  S slip_angle(const TyreInput<S>&, const S*, const P*) const {
    return S(0.0);
  }
};

/// The side force of a model, with its speeds times `forward`.
template <class Model>
double side_force(const Model& model, TyreInput<double> in, const double* z, const double* p, double forward = 1) {
  double zdot[Model::most_states + 1];
  TyreOutput<double> out;
  in.x[1] *= forward;
  in.x[2] *= forward;
  model(in, z, p, out, zdot);
  return out.lateral();
}

/// F_y = -D V.e_g - C alpha - C_c camber, moments m_c camber about e_x and d m_a alpha about n; F_y acts d times the
/// trail behind the contact point, d the direction of TyreSlip. None depends on F_n. Numbers: those of the slip, D, C,
/// C_c, m_c, m_a, trail.
struct LinearTyre {
  static constexpr int inputs = 4, most_states = 1;
  static constexpr bool slips = true, pulls_along = false, overturns = true, resists = false;
  static constexpr int most_numbers = 3 + 6;
  TyreSlip slip;
  int number_count() const { return slip.number_count() + 6; }
  int states() const { return slip.lags ? 1 : 0; }
  int initial_state(int) const { return 2; }
  /// Index of a trail among the numbers, or -1.
  int trail() const { return slip.number_count() + 5; }

  template <class S, class P>
  S slip_angle(const TyreInput<S>& in, const S* z, const P* p) const {
    using std::atan;
    return atan(slip.tangent(in.forward(), in.lateral(), z, p));
  }
  template <class S, class P>
  void operator()(const TyreInput<S>& in, const S* z, const P* p, TyreOutput<S>& out, S* zdot) const {
    const S alpha = slip_angle(in, z, p);
    slip.rate(in.forward(), in.lateral(), z, p, zdot);
    const P* c = p + slip.number_count();
    out.lateral() = -(S(c[0]) * in.lateral() + S(c[1]) * alpha + S(c[2]) * in.camber());
    out.overturning() = S(c[3]) * in.camber();
    out.aligning() = S(c[4]) * alpha * slip.direction(in.forward(), p[0]);
  }
  bool may_jump(const double*) const { return true; }
  void add_jump_places(const TyreInput<double>& in, const double* z, const double* p, bool pressed,
                       std::vector<JumpPlace>& places) const {
    slip.add_jump_places(
        in.forward(), in.lateral(), p, [&](double f) { return side_force(*this, in, z, p, f); }, places);
    places.push_back({.beyond = pressed ? 1.0 : -1.0,
                      .direction = -1,
                      .what = "is off the ground, and goes on to push sideways: the linear model knows of no load",
                      .advice = "Where wheels lift take model = \"calspan\" or \"magic_formula\"",
                      .of_motion = true});
  }
};

/// Calspan's model as the Iltis benchmark uses it (Frik, Leister, Schwartz, Vehicle System Dynamics 22 (1993)
/// 215-253):
///   mu = (B1 F + B3 + B4 F^2) SN, F the normal force
///   F <= A_omega A2:  a = (A1 F (F - A2) - A0 A2) / A2,  alpha_c = -A3 (A4 - F) F camber / (A4 a)
///   beyond:           a = -A0,                           alpha_c = A2 A3 (A4 - A2) camber / (A0 A4)
///   abar = a (alpha + alpha_c) / (mu F),  g = abar - abar |abar| / 3 + abar^3 / 27 up to |abar| = 3, beyond
///   its sign
/// (mu is taken as 0 where its parabola falls below: with the benchmark's numbers beyond 26 kN.)
///   F_y = mu F g,  M_z = d (AF1 F + AF2 |F_y|) F_y,  d the direction of TyreSlip
/// The branches join: with their slopes at |abar| = 3, with the value at A_omega = 1, F = A2 (there alpha_c
/// as well). Numbers: those of the slip, then A0, A1, A2, A3, A4, A_omega, B1, B3, B4, SN, AF1, AF2.
struct CalspanTyre {
  static constexpr int inputs = 4, most_states = 1;
  static constexpr bool slips = true, pulls_along = false, overturns = false, resists = false;
  static constexpr int most_numbers = 3 + 12;
  static constexpr int coefficients = 12;
  TyreSlip slip;
  int number_count() const { return slip.number_count() + coefficients; }
  int states() const { return slip.lags ? 1 : 0; }
  int initial_state(int) const { return 2; }
  int trail() const { return -1; }

  template <class S, class P>
  S slip_angle(const TyreInput<S>& in, const S* z, const P* p) const {
    using std::atan;
    return atan(slip.tangent(in.forward(), in.lateral(), z, p));
  }
  template <class S, class P>
  void operator()(const TyreInput<S>& in, const S* z, const P* p, TyreOutput<S>& out, S* zdot) const {
    slip.rate(in.forward(), in.lateral(), z, p, zdot);
    const S& F = in.normal();
    if (!(value_of(F) > 0)) return;
    const S alpha = slip_angle(in, z, p);
    const P* c = p + slip.number_count();
    const S A0(c[0]), A1(c[1]), A2(c[2]), A3(c[3]), A4(c[4]);
    const S grip = (S(c[6]) * F + S(c[7]) + S(c[8]) * F * F) * S(c[9]) * F;  // mu F
    S a, of_camber;
    if (value_of(F) <= value_of(c[5]) * value_of(c[2])) {
      a = A1 * F * (F - A2) / A2 - A0;
      of_camber = -A3 * (A4 - F) * F / (A4 * a);
    } else {
      a = -A0;
      of_camber = A2 * A3 * (A4 - A2) / (A0 * A4);
    }
    const S force = a * (alpha + of_camber * in.camber());  // what it would be without saturation
    const double size = std::abs(value_of(force)), most = value_of(grip);
    if (!(most > 0)) return;
    S& Fy = out.lateral();
    if (!(size < 3 * most)) {
      Fy = value_of(force) > 0 ? grip : -grip;
    } else {
      const S abar = force / grip, abs = value_of(abar) < 0 ? -abar : abar;
      Fy = force * (S(1.0) - abs / S(3.0) + abar * abar / S(27.0));
    }
    const S size_y = value_of(Fy) < 0 ? -Fy : Fy;
    out.aligning() = (S(c[10]) * F + S(c[11]) * size_y) * Fy * slip.direction(in.forward(), p[0]);
  }
  bool may_jump(const double* p) const { return p[slip.number_count() + 5] != 1 || (!slip.lags && p[0] == 0); }
  void add_jump_places(const TyreInput<double>& in, const double* z, const double* p, bool,
                       std::vector<JumpPlace>& places) const {
    slip.add_jump_places(
        in.forward(), in.lateral(), p, [&](double f) { return side_force(*this, in, z, p, f); }, places);
    const double* c = p + slip.number_count();
    if (c[5] == 1) return;
    const double load = c[5] * c[2];
    double numbers[most_numbers], below, above;
    std::copy(p, p + number_count(), numbers);
    TyreInput<double> there = in;
    there.x[0] = load;
    below = side_force(*this, there, z, numbers);
    numbers[slip.number_count() + 5] = 0;  // the branch beyond, whatever the load
    above = side_force(*this, there, z, numbers);
    places.push_back({in.normal() - load, 0, std::abs(above - below),
                      "passes the load A_omega A2, at which its branches meet only with A_omega = 1",
                      "Let A_omega be 1"});
  }
};

}  // namespace costate
