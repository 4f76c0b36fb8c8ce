// Constitutive laws of force elements along one degree of deformation x (a length or an angle) with rate xdot:
//   F(t, x, xdot, z, p), zdot = f(t, x, xdot, z, p); F > 0 pulls the two ends together.
// A law is one templated function object. Geometry is shared by AxialForce and AngularForce, derivatives come
// from dual numbers, so that a new law is a few lines of physics and no calculus.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "costate/derivative/dual.h"
#include "costate/element/law/motion_law.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

/// A law's numbers as path duals, in a buffer of the thread that grows once: a table has many.
inline PathDual* law_numbers(const double* p, int count) {
  thread_local std::vector<PathDual> buffer;
  if (buffer.size() < static_cast<std::size_t>(count)) buffer.resize(static_cast<std::size_t>(count));
  std::copy(p, p + count, buffer.begin());
  return buffer.data();
}

/// A ScalarLaw inside a templated law, for each scalar that laws are compiled for.
inline double evaluate(const ScalarLaw& f, double x, const double* p) { return f.value(x, p); }
inline PathDual evaluate(const ScalarLaw& f, const PathDual& x, const PathDual* p) { return f.value(x, p); }
template <int N>
Dual<N> evaluate(const ScalarLaw& f, const Dual<N>& x, const double* p) {
  const Dual<1> y = f.slope(x.v, p);
  return chain(x, y.v, y.d[0]);
}

/// df/dp_k of a ScalarLaw.
inline double law_number_partial(const ScalarLaw& f, double x, const double* p, int k) {
  PathDual* pp = law_numbers(p, f.number_count());
  pp[k].d[0] = Taylor2(1.0);
  return f.value(PathDual(x), pp).d[0].c0;
}

/// F = k (x - x0) + c xdot + F0 + spring(x - x0) + damper(xdot).
/// Numbers: k, x0, c, F0, then those of the optional spring law, then those of the optional damper law.
struct SpringDamperLaw {
  static constexpr int states = 0;
  std::shared_ptr<const ScalarLaw> spring, damper;

  template <class S, class P>
  void operator()(const S&, const S& x, const S& rate, const S*, const P* p, S& force, S*) const {
    force = S(p[0]) * (x - S(p[1])) + S(p[2]) * rate + S(p[3]);
    const P* q = p + 4;
    if (spring) {
      force += evaluate(*spring, x - S(p[1]), q);
      q += spring->number_count();
    }
    if (damper) force += evaluate(*damper, rate, q);
  }
  /// dF/dp_k.
  double number_partial(double x, double rate, const double* p, int k) const {
    const double *of_spring = p + 4, *of_damper = of_spring + (spring ? spring->number_count() : 0);
    if (k >= of_damper - p) return law_number_partial(*damper, rate, of_damper, static_cast<int>(k - (of_damper - p)));
    if (k >= 4) return law_number_partial(*spring, x - p[1], of_spring, k - 4);
    const double of[4] = {x - p[1], -p[0] - (k == 1 && spring ? spring->slope(x - p[1], of_spring).d[0] : 0), rate, 1};
    return of[k];
  }
  void add_motion_laws(std::vector<MotionLaw>& laws) const {
    if (spring) laws.push_back({.law = spring.get(), .first = 4, .key = "spring_law", .origin = 1});
    if (damper)
      laws.push_back({.law = damper.get(),
                      .first = 4 + (spring ? spring->number_count() : 0),
                      .key = "damper_law",
                      .of_rate = true});
  }
  double potential_energy(double x, const double* p) const {
    const double e = x - p[1];
    return 0.5 * p[0] * e * e + p[3] * e + (spring ? spring->integral(e, p + 4) : 0);
  }
};

/// A spring k in series with a damper c (Maxwell's relaxation element); the state is the damper's stroke.
///   F = k (x - x0 - z), zdot = F / c. Numbers: k, x0, c, z(0).
struct MaxwellLaw {
  static constexpr int states = 1;
  static constexpr int initial_state = 3;
  template <class S, class P>
  void operator()(const S&, const S& x, const S&, const S* z, const P* p, S& force, S* zdot) const {
    force = S(p[0]) * (x - S(p[1]) - z[0]);
    zdot[0] = force / S(p[2]);
  }
  double potential_energy(double x, const double* p, const double* z) const {
    const double e = x - p[1] - z[0];
    return 0.5 * p[0] * e * e;
  }
};

/// Of a law's state: what an actuator pushes with, or a stroke.
template <class Law>
const char* state_unit_of(const char* stroke, const char* force) {
  if constexpr (requires { Law::drives; })
    return force;
  else
    return stroke;
}

/// What a law stores, J; where it has states, by them as well.
template <class Law>
double stored_energy(const Law& law, double x, const double* p, const double* z) {
  if constexpr (requires { law.potential_energy(x, p, z); })
    return law.potential_energy(x, p, z);
  else
    return law.potential_energy(x, p);
}

/// A force that follows a command with a first-order lag: F = z, zdot = (command(t) - z) / tau.
/// Numbers: tau, z(0), then those of the command.
struct LagActuatorLaw {
  static constexpr bool drives = true;  // its power is worth an output
  static constexpr int states = 1;
  static constexpr int initial_state = 1;
  std::shared_ptr<const ScalarLaw> command;
  template <class S, class P>
  void operator()(const S& t, const S&, const S&, const S* z, const P* p, S& force, S* zdot) const {
    force = z[0];
    zdot[0] = (evaluate(*command, t, p + 2) - z[0]) / S(p[0]);
  }
  double potential_energy(double, const double*) const { return 0; }
};

/// The same for a torque T = z, which turns the angle forward where it is positive, as that of a couple does: F = -z.
struct LagTorqueLaw : LagActuatorLaw {
  static constexpr bool pushes = true;  // what it reports is -F
  template <class S, class P>
  void operator()(const S& t, const S& x, const S& rate, const S* z, const P* p, S& force, S* zdot) const {
    LagActuatorLaw::operator()(t, x, rate, z, p, force, zdot);
    force = -force;
  }
};

/// First derivatives of a law with respect to x, xdot and its states.
template <class Law>
struct LawPartials {
  static constexpr int n = 2 + Law::states;
  using D = Dual<n>;
  D force;
  D zdot[Law::states > 0 ? Law::states : 1];

  LawPartials(const Law& law, double t, double x, double rate, const double* z, const double* p) {
    D zz[Law::states > 0 ? Law::states : 1];
    for (int i = 0; i < Law::states; ++i) zz[i] = D::variable(z[i], 2 + i);
    law(D(t), D::variable(x, 0), D::variable(rate, 1), zz, p, force, zdot);
  }
};

/// Derivatives of a law's force and state rates with respect to its number k of `count`.
template <class Law>
void calc_law_number_partial(const Law& law, double t, double x, double rate, const double* z, const double* p,
                             int count, int k, double& force_p, double* f_p) {
  if constexpr (requires { law.number_partial(x, rate, p, k); }) {
    force_p = law.number_partial(x, rate, p, k);
  } else {
    PathDual *pp = law_numbers(p, count), zz[Law::states + 1], force, zdot[Law::states + 1];
    pp[k].d[0] = Taylor2(1.0);
    for (int i = 0; i < Law::states; ++i) zz[i] = PathDual(z[i]);
    law(PathDual(t), PathDual(x), PathDual(rate), zz, pp, force, zdot);
    force_p = force.d[0].c0;
    for (int i = 0; i < Law::states; ++i) f_p[i] = zdot[i].d[0].c0;
  }
}

}  // namespace costate
