// A wheel or flywheel, symmetric about an axis fixed in a rigid body, that spins about it: the kinetic energy of its
// axial rotation, T = J s^2 / 2 with s = a . omega + thetad. The rest of its inertia (mass and transverse moments)
// belongs to the carrying body. Its own turning frame is never needed, so that a fast spin costs no short steps.
// Coordinates: the Euler parameters of the body, the spin angle theta [rad]. Numbers: J [kg m^2].
// With g(x) = G(x)^T a (rotation.h) and s' = 2 g(p).pdd + thetadd:
//   r_p = J (2 s' g(p) + 4 s g(pd)),  r_theta = J s'                         lib/README.md (11.30)
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/rotation.h"

namespace costate {

class Rotor final : public BodyOf<Rotor> {
 public:
  /// euler: e0 ... e3 of the carrying body; axis: in its frame, of any length but zero.
  Rotor(std::string name, const std::vector<int>& euler, int angle, int inertia_number, const Vector3& axis);

  template <class S>
  void physics(const S* q, const S* v, const S* a, const S* n, S* r) const {
    S w[3], spin = v[4], rate = a[4];
    const S axis[3] = {S(axis_[0]), S(axis_[1]), S(axis_[2])};
    body_rate(q, v, w);
    spin += S(2.0) * dot3(axis, w);
    body_rate(q, a, w);
    rate += S(2.0) * dot3(axis, w);
    S across[3], turning[3];
    for (int i = 0; i < 3; ++i) {
      across[i] = n[0] * rate * axis[i];
      turning[i] = n[0] * spin * axis[i];
    }
    for (int i = 0; i < 4; ++i) r[i] = S(0.0);
    add_body_moment(q, across, 2, r);
    add_body_moment(v, turning, 4, r);
    r[4] = n[0] * rate;
  }

  /// The spin about the axis against space, a . omega + thetad.
  std::vector<Measure> measures() const override { return {{"spin", "rad/s", false}}; }
  PathDual measure(int, const MeasureArguments& x) const override;

  bool by_hand() const override { return true; }
  void calc_mass(const LocalState& s, LocalMatrix& M) const override;
  void calc_force(const LocalState& s, double* Q) const override;
  void calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const override;
  void calc_number_partial(const LocalState& s, int number, double* r_p) const override;

 private:
  Vector3 axis_;
};

}  // namespace costate
