// A rigid body in space: reference point r [m] and Euler parameters p = (e0, e1, e2, e3), kept at p.p = 1 by
// a constraint. Numbers: mass m [kg]; inertia tensor J about the centre of mass in the body's frame, xx, yy,
// zz, xy, xz, yz [kg m^2] (entries of the tensor: xy is minus the integral of x y); centre of mass c in the
// body's frame [m]; gravity g [m/s^2]. With the centre at r + A c and f = m (rddot_c - g):
//   r1 = (f, B(p, c)^T f + 4 G^T J G pddot + 8 Gdot^T J G pdot)          lib/README.md (11.15)
// A mass at a point of a body is the same without inertia of its own.
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/rotation.h"

namespace costate {

class RigidBody final : public BodyOf<RigidBody> {
 public:
  enum class Reports { nothing, rates };
  RigidBody(std::string kind, std::string name, const std::vector<int>& coordinates, const std::vector<int>& numbers,
            Reports reports = Reports::rates);

  template <class S>
  void physics(const S* q, const S* v, const S* a, const S* n, S* r) const {
    const S *p = q + 3, *pd = v + 3, *pdd = a + 3, *c = n + 7, *g = n + 10;
    S along[3], turning[3], f[3];
    rotated_rate(p, pdd, c, along);
    rotated_rate(pd, pd, c, turning);
    for (int i = 0; i < 3; ++i) r[i] = f[i] = n[0] * (a[i] + along[i] + turning[i] - g[i]);
    S Ga[3], Gv[3], JGa[3], JGv[3];
    body_rate(p, pdd, Ga);
    body_rate(p, pd, Gv);
    inertia_times(n, Ga, JGa);
    inertia_times(n, Gv, JGv);
    for (int i = 0; i < 4; ++i) r[3 + i] = S(0.0);
    add_rotated_force(p, c, f, r + 3);
    add_body_moment(p, JGa, 4, r + 3);
    add_body_moment(pd, JGv, 8, r + 3);
  }
  /// Angular velocity in the body's and in the global frame; roll, pitch and yaw.
  std::vector<Measure> measures() const override;
  PathDual measure(int i, const MeasureArguments& x) const override;
  bool measure_value(int i, const ValueArguments& x, double& value) const override;

  bool by_hand() const override { return true; }
  void calc_mass(const LocalState& s, LocalMatrix& M) const override;
  void calc_force(const LocalState& s, double* Q) const override;
  void calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const override;
  void calc_number_partial(const LocalState& s, int number, double* r_p) const override;
  double potential_energy(const LocalState& s) const override;

 private:
  template <class S>
  S measured(int i, const MeasureArgumentsOf<S>& x) const;
  template <class S>
  static void inertia_times(const S* n, const S* x, S* out) {
    out[0] = n[1] * x[0] + n[4] * x[1] + n[5] * x[2];
    out[1] = n[4] * x[0] + n[2] * x[1] + n[6] * x[2];
    out[2] = n[5] * x[0] + n[6] * x[1] + n[3] * x[2];
  }

  Reports reports_;
};

}  // namespace costate
