// A spherical joint: two points of space coincide, phi = r_j - r_i [m]. Numbers: those of the points.
// The multipliers are the joint's force on point i, in N.
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/spatial_vector.h"

namespace costate {

class SpatialCoincidenceConstraint final : public ConstraintOf<SpatialCoincidenceConstraint> {
 public:
  SpatialCoincidenceConstraint(std::string kind, std::string name, SpatialVector d);

  int rows() const override { return 3; }
  std::string row_name(int i) const override { return std::string(1, "xyz"[i]); }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    d_.value(q, p, phi);
  }
  std::vector<Measure> measures() const override {
    return {{"reaction_x", "N", true}, {"reaction_y", "N", true}, {"reaction_z", "N", true}};
  }
  /// The joint's force on the first point.
  PathDual measure(int i, const MeasureArguments& x) const override { return x.lambda[i]; }
  bool measure_value(int i, const ValueArguments& x, double& value) const override {
    value = x.lambda[i];
    return true;
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;
  double calc_number_gradient(const LocalState& s, int number, const ConstraintWeights& w) const override;

 private:
  SpatialVector d_;
};

}  // namespace costate
