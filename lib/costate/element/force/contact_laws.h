// Laws of compliant contact, each a function of a few lines for every scalar type.
//
// Normal force, penetration d > 0, its rate dd, approach speed v0 latched at the touch, restitution e as prescribed:
//   F = K d^n (1 + chi dd/v0), never pulling; kelvin-voigt: F = K d^n + C dd.
// chi after: Hunt and Crossley 1975, Herbert and McWhannell 1977, Lee and Wang 1983, Lankarani and Nikravesh 1990,
// Zhiying and Qishao 2006, Gonthier et al. 2004, Flores et al. 2011, Hu and Guo 2015. What comes out obeys, for all K,
// n and masses, chi (1 + e_out) = ln((1 + chi)/(1 - chi e_out)).
//
// Friction along -v, with the normal force N and v_s the speed of transition (Marques, Flores, Pimenta Claro,
// Lankarani, Nonlinear Dynamics 86 (2016) 1407-1443). Dahl and LuGre carry the deflection w of bristles for each
// direction, N sigma their stiffness, so that nothing divides by N: w' = v - sigma |v| w/mu, F = N (sigma w + sigma1
// w').
#pragma once

#include <array>
#include <string>
#include <vector>

#include "costate/derivative/dual.h"

namespace costate {

enum class NormalLaw {
  linear,
  hertz,
  hunt_crossley,
  herbert_mcwhannell,
  lee_wang,
  lankarani_nikravesh,
  gonthier,
  zhiying_qishao,
  flores,
  hu_guo,
  kelvin_voigt
};
inline constexpr int kNormalLaws = 11;
inline constexpr std::array<const char*, kNormalLaws> kNormalLawNames{
    "linear",         "hertz",  "hunt-crossley", "herbert-mcwhannell", "lee-wang", "lankarani-nikravesh", "gonthier",
    "zhiying-qishao", "flores", "hu-guo",        "kelvin-voigt"};

/// Whether F jumps at the touch, or its law needs the speed latched there: whether the touch is an event.
inline bool latches(NormalLaw law) { return law != NormalLaw::linear && law != NormalLaw::hertz; }
/// Whether F is a function of the latched speed, and not only of having been latched.
inline bool uses_latched_speed(NormalLaw law) { return latches(law) && law != NormalLaw::kelvin_voigt; }

/// chi(e) of the laws that have one.
template <class S>
S damping_ratio(NormalLaw law, const S& e) {
  using std::exp;
  const S one(1.0);
  switch (law) {
    case NormalLaw::hunt_crossley:
      return S(1.5) * (one - e);
    case NormalLaw::herbert_mcwhannell: {
      const S u = S(2.0) * e - one;
      return S(6.0) * (one - e) / (u * u + S(3.0));
    }
    case NormalLaw::lee_wang:
      return S(0.75) * (one - e);
    case NormalLaw::lankarani_nikravesh:
      return S(0.75) * (one - e * e);
    case NormalLaw::gonthier:
      return (one - e * e) / e;
    case NormalLaw::zhiying_qishao:
      return S(0.75) * (one - e * e) * exp(S(2.0) * (one - e));
    case NormalLaw::flores:
      return S(1.6) * (one - e) / e;
    case NormalLaw::hu_guo:
      return S(1.5) * (one - e) / e;
    default:
      return S(0.0);
  }
}

/// K d^n, zero of an open gap: what the normal force stores and gives back.
template <class S>
S elastic_force(NormalLaw law, const S* p, const S& depth) {
  using std::exp;
  using std::log;
  if (!(value_of(depth) > 0)) return S(0.0);
  return law == NormalLaw::linear ? p[0] * depth : p[0] * exp(p[1] * log(depth));
}

/// F as it would be if it could pull. p: K [N/m^n], n, e, C [N s/m]; v0 is read by the laws that latch.
template <class S>
S uncut_force(NormalLaw law, const S* p, const S& depth, const S& rate, const S& v0) {
  // A contact that is closed by its mode may be open by a rounding, at the touch itself, where F jumps already.
  S f = elastic_force(law, p, depth);
  if (law == NormalLaw::kelvin_voigt)
    f += p[3] * rate;
  else if (latches(law))
    f *= S(1.0) + damping_ratio(law, p[2]) * rate / v0;
  return f;
}

template <class S>
S normal_force(NormalLaw law, const S* p, const S& depth, const S& rate, const S& v0) {
  const S f = uncut_force(law, p, depth, rate, v0);
  return value_of(f) > 0 ? f : S(0.0);
}

enum class FrictionModel { none, coulomb, threlfall, ambrosio, bengisu_akay, stribeck, brown_mcphee, dahl, lugre };
inline constexpr int kFrictionModels = 9;
inline constexpr std::array<const char*, kFrictionModels> kFrictionModelNames{
    "none", "coulomb", "threlfall", "ambrosio", "bengisu-akay", "stribeck", "brown-mcphee", "dahl", "lugre"};

inline bool has_bristles(FrictionModel model) { return model == FrictionModel::dahl || model == FrictionModel::lugre; }

/// Whether the touch is an event: of bristles, too, whose rate jumps there from nothing to the slip's.
inline bool touch_is_event(NormalLaw law, FrictionModel friction) { return latches(law) || has_bristles(friction); }

/// Numbers of friction: mu_d, mu_s, v_s [m/s], v_0 [m/s] (where Ambrosio's ramp begins), xi [s/m] (Bengisu and Akay's
/// decay), sigma [1/m], sigma1 [s/m].
inline constexpr int kFrictionNumbers = 7;

template <class S>
S stribeck_coefficient(const S* p, const S& speed) {
  using std::exp;
  const S r = speed / p[2];
  return p[0] + (p[1] - p[0]) * exp(-(r * r));
}

/// F/N at a speed > 0, of the models without bristles.
template <class S>
S friction_coefficient(FrictionModel model, const S* p, const S& speed) {
  using std::exp;
  using std::tanh;
  const S one(1.0);
  switch (model) {
    case FrictionModel::coulomb:
      return p[0] * tanh(speed / p[2]);
    case FrictionModel::threlfall:
      if (value_of(speed) >= value_of(p[2])) return p[0];
      return p[0] * (one - exp(S(-3.0) * speed / p[2])) / (one - exp(S(-3.0)));
    case FrictionModel::ambrosio:
      if (value_of(speed) <= value_of(p[3])) return S(0.0);
      if (value_of(speed) >= value_of(p[2])) return p[0];
      return p[0] * (speed - p[3]) / (p[2] - p[3]);
    case FrictionModel::bengisu_akay: {
      const S u = speed - p[2];
      if (value_of(u) < 0) return p[1] * (one - u * u / (p[2] * p[2]));
      return p[0] + (p[1] - p[0]) * exp(-(p[4] * u));
    }
    case FrictionModel::stribeck:
      return stribeck_coefficient(p, speed) * tanh(speed / p[2]);
    case FrictionModel::brown_mcphee: {
      const S r = speed / p[2], bell = S(0.25) * r * r + S(0.75);
      return p[0] * tanh(S(4.0) * r) + (p[1] - p[0]) * r / (bell * bell);
    }
    default:
      return S(0.0);
  }
}

/// Force (dim) along -v at the normal force N, and the rates of the bristles w (dim; of models that have them).
template <class S>
void friction_force(FrictionModel model, int dim, const S* p, const S& N, const S* v, const S* w, S* force, S* wdot) {
  using std::sqrt;
  if (model == FrictionModel::none) return;
  // A speed that is smooth at rest: larger than the true one by (1e-6 v_s)^2/2v.
  S square = S(1e-12) * p[2] * p[2];
  for (int i = 0; i < dim; ++i) square += v[i] * v[i];
  const S speed = sqrt(square);
  if (!has_bristles(model)) {
    const S factor = -(N * friction_coefficient(model, p, speed) / speed);
    for (int i = 0; i < dim; ++i) force[i] = factor * v[i];
    return;
  }
  const S mu = model == FrictionModel::dahl ? p[0] : stribeck_coefficient(p, speed);
  for (int i = 0; i < dim; ++i) {
    wdot[i] = v[i] - p[5] * speed * w[i] / mu;
    force[i] = -(N * p[5] * w[i]);
    if (model == FrictionModel::lugre) force[i] -= N * p[6] * wdot[i];
  }
}

/// The moment M = -c N omega/|omega| tanh(|omega|/omega_s) against rolling, and in space that against spinning about
/// the normal n; p: c of rolling, c of spinning, omega_s. One component in the plane, three in space.
template <int dim, class S>
void turning_moment(const S* omega, const S* n, const S* p, const S& N, S* moment) {
  using std::sqrt;
  using std::tanh;
  const S& scale = p[2];
  const auto factor = [&](const S& square, const S& arm) {
    const S speed = sqrt(square + S(1e-12) * scale * scale);
    return arm * N * tanh(speed / scale) / speed;
  };
  if constexpr (dim == 2) {
    moment[0] = -(factor(omega[0] * omega[0], p[0]) * omega[0]);
  } else {
    S roll[3], square(0.0), spin(0.0);
    for (int i = 0; i < 3; ++i) spin += n[i] * omega[i];
    for (int i = 0; i < 3; ++i) {
      roll[i] = omega[i] - spin * n[i];
      square += roll[i] * roll[i];
    }
    const S rolling = factor(square, p[0]), spinning = factor(spin * spin, p[1]);
    for (int i = 0; i < 3; ++i) moment[i] = -(rolling * roll[i]) - spinning * spin * n[i];
  }
}

}  // namespace costate
