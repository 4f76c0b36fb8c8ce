// Two coordinates move in a fixed ratio: phi = q_2 - factor ratio q_1 - offset. A gear, a rack and its
// pinion, a screw. Numbers: the ratio (a length for what turns an angle into a way), the offset. The factor
// is a constant, such as 1/(2 pi) for a lead per turn. The multiplier is the force or torque on the second
// coordinate's side: M a + Phi_q^T lambda = Q.
#pragma once

#include "costate/element/element.h"

namespace costate {

class CouplingConstraint final : public ConstraintOf<CouplingConstraint> {
 public:
  /// `reaction_unit`: that of the multiplier, N m where the second coordinate is an angle, N where it is a
  /// length.
  CouplingConstraint(std::string kind, std::string name, int first, int second, double factor, int ratio_number,
                     int offset_number, std::string reaction_unit);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return "ratio"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    phi[0] = q[1] - S(factor_) * p[0] * q[0] - p[1];
  }
  /// What the coupling does to the second coordinate, -lambda.
  std::vector<Measure> measures() const override { return {{"reaction", reaction_unit_, true}}; }
  PathDual measure(int, const MeasureArguments& x) const override { return -x.lambda[0]; }
  bool measure_value(int, const ValueArguments& x, double& value) const override {
    value = -x.lambda[0];
    return true;
  }

  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState&, double*) const override {}
  void calc_hessian(const LocalState&, LocalMatrix&) const override {}
  void calc_partials(const LocalState&, LocalMatrix&, LocalMatrix&, LocalMatrix&) const override {}
  void calc_number_partial(const LocalState& s, int number, double* phi_p, double* phid_p, double* phidd_p,
                           double* reaction_p) const override;

 private:
  double factor_;
  std::string reaction_unit_;
};

}  // namespace costate
