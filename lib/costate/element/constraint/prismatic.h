// A prismatic joint between two bodies of the plane (or a body and the ground), by a point on each: the
// second point slides along an axis through the first, and the bodies keep their relative angle. With d = r_j
// - r_i, theta = angle_i + axis, n = (-sin theta, cos theta):
//   phi_0 = angle_j - angle_i - relative [rad],  phi_1 = n.d [m].
// Numbers: axis [rad] in the first body's frame, relative [rad], then those of the points. The multipliers
// are the joint's torque [N m] and its force along n [N] on the first body.
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/planar_vector.h"

namespace costate {

class PrismaticConstraint final : public ConstraintOf<PrismaticConstraint> {
 public:
  /// Each point is on the ground or on a body, and not both are on the ground or on one body; throws
  /// ModelError.
  PrismaticConstraint(std::string kind, std::string name, PlanarVector d, int axis_number, int relative_number);

  int rows() const override { return 2; }
  std::string row_name(int i) const override { return i == 0 ? "angle" : "offset"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    using std::cos;
    using std::sin;
    S d[2];
    d_.value(q, p + 2, d);
    const S theta = angle_i(q) + p[0];
    phi[0] = angle_j(q) - angle_i(q) - p[1];
    phi[1] = cos(theta) * d[1] - sin(theta) * d[0];
  }
  std::vector<Measure> measures() const override {
    return {{"travel", "m", false}, {"torque", "N m", true}, {"force", "N", true}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override;
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;

 private:
  template <class S>
  S angle_i(const S* q) const {
    return i_ < 0 ? S(0.0) : q[i_];
  }
  template <class S>
  S angle_j(const S* q) const {
    return j_ < 0 ? S(0.0) : q[j_];
  }
  struct Frame;

  PlanarVector d_;
  int i_ = -1, j_ = -1;  // local index of each body's angle; -1: ground
};

}  // namespace costate
