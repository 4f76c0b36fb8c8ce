// The second point stays in a plane through the first, fixed to the first one's body: phi = u . d with
// d = r_j - r_i and u = A(p_i) s the plane's normal, in m times the length of s.
// Numbers: the normal s in the first body's frame (3, of any length), then those of the points.
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/body_direction.h"
#include "costate/element/point/spatial_vector.h"

namespace costate {

class InPlaneConstraint final : public ConstraintOf<InPlaneConstraint> {
 public:
  InPlaneConstraint(std::string kind, std::string name, SpatialVector d, const std::vector<int>& normal_numbers);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return "height"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    S u[3], d[3];
    u_.value(q + rotation_, p, u);
    d_.value(q, p + 3, d);
    phi[0] = dot3(u, d);
  }
  /// The force on the second point along the normal.
  std::vector<Measure> measures() const override { return {{"reaction", "N", true}}; }
  PathDual measure(int, const MeasureArguments& x) const override {
    using std::sqrt;
    return -x.lambda[0] * sqrt(dot3(x.p, x.p));
  }

  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;

 private:
  SpatialVector d_;
  BodyDirection u_;
  int rotation_;  // local index of the first body's Euler parameters
};

}  // namespace costate
