// Gives the turn of a second body against a first (or the ground) about a common axis an angle coordinate
// that counts full turns: phi = sin(angle) w.u - cos(angle) c.u, where w is the first normal across the axis,
// c = axis x w, and u the second normal across its axis, all of length 1. Regular at every angle (phi_angle =
// 1 where the axes coincide), so the multiplier is the torque [N m] on the coordinate. Coordinates: those of
// the first direction, of the second, the angle. Numbers: axis and normal of the first body, then of the
// second, in their frames and of any length, in the order axis_i, axis_j, normal_i, normal_j. See
// lib/README.md (11.20).
#pragma once

#include "costate/element/angle_row.h"
#include "costate/element/element.h"
#include "costate/element/point/body_direction.h"

namespace costate {

class TurnAngleConstraint final : public ConstraintOf<TurnAngleConstraint>, public AngleRow {
 public:
  TurnAngleConstraint(std::string kind, std::string name, BodyDirection i, BodyDirection j, int angle_coordinate,
                      const std::vector<int>& numbers);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return "angle"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    using std::cos;
    using std::sin;
    const S& angle = q[i_.size() + j_.size()];
    const S sn = sin(angle), cs = cos(angle);
    S w[3], c[3], u[3], unused[3], g[3], G[3], U[3];
    across_axis(p, p + 6, w, c);
    across_axis(p + 3, p + 9, u, unused);
    for (int k = 0; k < 3; ++k) g[k] = sn * w[k] - cs * c[k];
    i_.value(q, g, G);
    j_.value(q + i_.size(), u, U);
    phi[0] = dot3(G, U);
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;

 private:
  struct Frame;
  BodyDirection i_, j_;
};

}  // namespace costate
