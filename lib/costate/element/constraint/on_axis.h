// The second point stays on a line through the first, fixed to the first one's body: phi_k = b_k . d with
// d = r_j - r_i and b_1, b_2 the pair of length 1 perpendicular to the axis (body_direction.h), in m: multipliers are
// forces along them.
// Numbers: the axis in the first body's frame (3, of any length), then those of the points.
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/body_offset.h"

namespace costate {

class OnAxisConstraint final : public ConstraintOf<OnAxisConstraint> {
 public:
  OnAxisConstraint(std::string kind, std::string name, SpatialVector d, const std::vector<int>& axis_numbers,
                   const Vector3& first_axis);

  int rows() const override { return 2; }
  std::string row_name(int i) const override { return i == 0 ? "offset_1" : "offset_2"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    S b[2][3];
    perpendicular_units(p, across_, b[0], b[1]);
    for (int k = 0; k < 2; ++k) phi[k] = offset_.value(q, p + 3, b[k]);
  }
  /// Of the second point along the axis; and the joint's force on the first body, which acts at the second point.
  std::vector<Measure> measures() const override {
    return {{"travel", "m", false}, {"reaction_x", "N", true}, {"reaction_y", "N", true}, {"reaction_z", "N", true}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override;
  bool measure_value(int i, const ValueArguments& x, double& value) const override;

  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;

 private:
  template <class S>
  S measured(int i, const MeasureArgumentsOf<S>& x) const;
  BodyOffset offset_;
  int across_;
};

}  // namespace costate
