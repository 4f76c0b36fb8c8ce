// Conditions u.w = 0 between directions u = A_i s_i fixed to one body and w = A_j s_j fixed to another (or
// the ground), the exact primitive ("dot-1") of joints in space:
//   perpendicular  a_i . a_j = 0                              universal joint
//   parallel       b_i . a_j = 0, c_i . a_j = 0               hinge, cylindrical joint
//   aligned        these and n_i . (a_j x n_j) = 0            translational joint: no turn about the axis
// a_i, a_j are the axes, (b_i, c_i) the pair perpendicular to a_i (body_direction.h), n_i, n_j directions across
// the axes. Numbers: a_i, a_j (3 each, of any length), aligned: then n_i, n_j. All are taken with length 1, so that the
// multipliers are torques [N m], about u x w.
#pragma once

#include <algorithm>

#include "costate/element/element.h"
#include "costate/element/point/body_direction.h"

namespace costate {

class DirectionsConstraint final : public ConstraintOf<DirectionsConstraint> {
 public:
  enum class Condition { perpendicular, parallel, aligned };
  /// `first_axis`: the values that a_i starts with, which choose the perpendicular pair.
  DirectionsConstraint(std::string kind, std::string name, Condition condition, BodyDirection i, BodyDirection j,
                       const std::vector<int>& numbers, const Vector3& first_axis);

  int rows() const override {
    return condition_ == Condition::perpendicular ? 1 : condition_ == Condition::parallel ? 2 : 3;
  }
  std::string row_name(int i) const override;

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    S s[3][3], t[3][3];
    components(p, s, t);
    for (int k = 0; k < rows(); ++k) {
      S u[3], w[3];
      i_.value(q, s[k], u);
      j_.value(q + i_.size(), t[k], w);
      phi[k] = dot3(u, w);
    }
  }
  /// The joint's moment on the first body.
  std::vector<Measure> measures() const override {
    return {{"moment_x", "N m", true}, {"moment_y", "N m", true}, {"moment_z", "N m", true}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override;
  bool measure_value(int i, const ValueArguments& x, double& value) const override;
  Condition condition() const { return condition_; }
  /// The least cosine between the axes, and of aligned ones between the normals (as a x n): 1, or -1 where the rows
  /// hold with a pair of them opposite.
  double agreement(const double* q, const double* p) const;
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
  /// The components s_i and s_j of each row.
  template <class S>
  void components(const S* p, S (*s)[3], S (*t)[3]) const {
    if (condition_ == Condition::perpendicular)
      unit_direction(p, s[0]);
    else
      perpendicular_units(p, across_, s[0], s[1]);
    unit_direction(p + 3, t[0]);
    if (condition_ != Condition::perpendicular) std::copy_n(t[0], 3, t[1]);
    if (condition_ != Condition::aligned) return;
    unit_direction(p + 6, s[2]);
    cross3(p + 3, p + 9, t[2]);
    unit_direction(t[2], t[2]);
  }
  struct Pairs;

  Condition condition_;
  BodyDirection i_, j_;
  int across_;
};

}  // namespace costate
