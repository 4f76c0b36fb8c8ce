// Gives the direction of a vector between two planar points an angle coordinate that counts full turns:
// phi = dx sin(angle) - dy cos(angle) [m]. Regular for any direction (its derivative with respect to the angle is
// the distance, up to sign), so no change of formula is ever needed. Coordinates: those of the vector, then the angle.
#pragma once

#include "costate/element/angle_row.h"
#include "costate/element/element.h"
#include "costate/element/point/planar_vector.h"

namespace costate {

class BarAngleConstraint final : public ConstraintOf<BarAngleConstraint>, public AngleRow {
 public:
  BarAngleConstraint(std::string name, PlanarVector d, int angle_coordinate);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return "angle"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    using std::cos;
    using std::sin;
    S d[2];
    d_.value(q, p, d);
    const S& angle = q[d_.size()];
    phi[0] = d[0] * sin(angle) - d[1] * cos(angle);
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;

 private:
  PlanarVector d_;
};

}  // namespace costate
