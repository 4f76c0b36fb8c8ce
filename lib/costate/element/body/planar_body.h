// A rigid body of the plane in reference-point coordinates x, y [m], angle [rad].
// Numbers: mass m [kg], moment of inertia I about the centre of mass [kg m^2], centre of mass in the body's
// frame cx, cy [m], gravity x, y [m/s^2]. With the centre at R + A(angle) c:
//   r = (m (rddot_c - g), I alpha + (A' c)^T m (rddot_c - g)).
#pragma once

#include "costate/element/element.h"

namespace costate {

class PlanarBody final : public BodyOf<PlanarBody> {
 public:
  /// kind: "body", or "mass" of one that sits on a body's point.
  PlanarBody(std::string kind, std::string name, std::vector<int> coordinates, std::vector<int> numbers);

  template <class S>
  void physics(const S* q, const S* v, const S* a, const S* p, S* r) const {
    using std::cos;
    using std::sin;
    const S c = cos(q[2]), s = sin(q[2]);
    const S rx = c * p[2] - s * p[3], ry = s * p[2] + c * p[3];
    const S fx = p[0] * (a[0] - a[2] * ry - v[2] * v[2] * rx - p[4]);
    const S fy = p[0] * (a[1] + a[2] * rx - v[2] * v[2] * ry - p[5]);
    r[0] = fx;
    r[1] = fy;
    r[2] = p[1] * a[2] - ry * fx + rx * fy;
  }
  bool by_hand() const override { return true; }
  void calc_mass(const LocalState& s, LocalMatrix& M) const override;
  void calc_force(const LocalState& s, double* Q) const override;
  void calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const override;
  void calc_number_partial(const LocalState& s, int number, double* r_p) const override;
  double potential_energy(const LocalState& s) const override;
};

}  // namespace costate
