// Keeps the distance between two planar points: phi = d.d - L^2 [m^2] with d = r_j - r_i.
// Numbers: L [m], then those of the points. Multiplier unit N/m; the force along d is -2 L lambda (tension > 0
// for lambda > 0). The square, not the root, so that phi is a polynomial in natural coordinates.
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/planar_vector.h"

namespace costate {

class DistanceConstraint final : public ConstraintOf<DistanceConstraint> {
 public:
  DistanceConstraint(std::string kind, std::string name, PlanarVector d, int length_number);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return "length"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    S d[2];
    d_.value(q, p + 1, d);
    phi[0] = d[0] * d[0] + d[1] * d[1] - p[0] * p[0];
  }
  std::vector<Measure> measures() const override { return {{"tension", "N", true}}; }
  /// 2 L lambda: positive when the link is pulled.
  PathDual measure(int, const MeasureArguments& x) const override { return 2.0 * x.p[0] * x.lambda[0]; }
  bool measure_value(int, const ValueArguments& x, double& value) const override {
    value = 2.0 * x.p[0] * x.lambda[0];
    return true;
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;
  void calc_number_partial(const LocalState& s, int number, double* phi_p, double* phid_p, double* phidd_p,
                           double* reaction_p) const override;
  double calc_number_gradient(const LocalState& s, int number, const ConstraintWeights& w) const override;

 private:
  PlanarVector d_;
  bool linear_;  // both points free or on the ground: d = r_j - r_i with unit Jacobians
};

}  // namespace costate
