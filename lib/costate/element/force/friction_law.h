// Friction that is continuous and differentiable in the sliding velocity v, after P. Brown and J. McPhee, A
// Continuous Velocity-Based Friction Model for Dynamics and Control With Physically Meaningful Parameters,
// Journal of Computational and Nonlinear Dynamics 11(5), 054502 (2016):
//   F = N (mu_d tanh(4 r) + (mu_s - mu_d) r / (r^2/4 + 3/4)^2) + c v,  r = v / v_t.
// The transition velocity v_t is where the friction is largest, N mu_s (to mu_d (1 - tanh 4) = 7e-4 mu_d);
// what looks like sticking is a creep below v_t. N is given and positive, so that the paper's factor tanh(4
// N/N_t) of the viscous term, which switches it off without contact, is left out.
#pragma once

#include "costate/derivative/dual.h"

namespace costate {

/// A law for AxialForce, AngularForce and their like. On a length v is the rate. On an angle v = R times the
/// rate, and the torque is R F, R the radius at which surfaces slide. Numbers: N [N], mu_s, mu_d, v_t [m/s],
/// c [N s/m], R [m] (1 on a length).
struct FrictionLaw {
  static constexpr int states = 0;
  static constexpr int number_count = 6;

  template <class S, class P>
  void operator()(const S&, const S&, const S& rate, const S*, const P* p, S& force, S*) const {
    using std::tanh;
    const S v = S(p[5]) * rate, r = v / S(p[3]), bell = S(0.25) * r * r + S(0.75);
    force = S(p[5]) * (S(p[0]) * (S(p[2]) * tanh(S(4.0) * r) + (S(p[1]) - S(p[2])) * r / (bell * bell)) + S(p[4]) * v);
  }
  double potential_energy(double, const double*) const { return 0; }
};

}  // namespace costate
