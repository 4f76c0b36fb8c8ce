// The place of the second point along a direction fixed to the body of the first: phi = n . d - s with n =
// a/|a| and d = r_j - r_i, in m. With a coordinate s this gives a slide its displacement; without (s = 0) the
// point stays in the plane across a through the first point. Numbers: a in the first body's frame (3, of any
// length), then those of the points. The multiplier is a force [N] along n.
#pragma once

#include <optional>

#include "costate/element/element.h"
#include "costate/element/point/body_offset.h"

namespace costate {

class OffsetConstraint final : public ConstraintOf<OffsetConstraint> {
 public:
  OffsetConstraint(std::string kind, std::string name, SpatialVector d, const std::vector<int>& direction_numbers,
                   std::optional<int> displacement_coordinate);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return moves_ ? "displacement" : "offset"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    S n[3];
    unit_direction(p, n);
    phi[0] = offset_.value(q, p + 3, n);
    if (moves_) phi[0] -= q[offset_.size()];
  }
  /// Of a plane: the joint's force on the first body, which acts at the second point.
  std::vector<Measure> measures() const override {
    if (moves_) return {};
    return {{"reaction_x", "N", true}, {"reaction_y", "N", true}, {"reaction_z", "N", true}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override {
    PathDual n[3], u[3];
    unit_direction(x.p, n);
    offset_.direction(x.q, n, u);
    return x.lambda[0] * u[i];
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
  BodyOffset offset_;
  bool moves_;  // has the coordinate s
};

}  // namespace costate
