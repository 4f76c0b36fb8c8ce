// A bilinear condition between two vectors u = r_b - r_a and w = r_d - r_c of the plane: u^T T w = 0 [m^2] with
// T = 1 (perpendicular) or T = [[0, 1], [-1, 0]] (parallel, the cross product). A slot (point on a line) is the
// parallel condition with c = a. Numbers: those of the four points.
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/planar_vector.h"

namespace costate {

class TwoVectorConstraint final : public ConstraintOf<TwoVectorConstraint> {
 public:
  enum class Condition { perpendicular, parallel };
  TwoVectorConstraint(std::string kind, std::string name, Condition condition, PlanarVector u, PlanarVector w);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return condition_ == Condition::parallel ? "parallel" : "perpendicular"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    S u[2], w[2];
    u_.value(q, p, u);
    w_.value(q + u_.size(), p + u_.number_count(), w);
    phi[0] = condition_ == Condition::parallel ? u[0] * w[1] - u[1] * w[0] : u[0] * w[0] + u[1] * w[1];
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;

 private:
  Eigen::Matrix2d T() const;
  Condition condition_;
  PlanarVector u_, w_;
};

}  // namespace costate
