// A massless rod to a point that slides in a body: phi = d.d - L^2 [m^2], d = r_j - r_i - x A(p_i) s, with r_i the
// sliding end at x = 0, s the unit direction in which it slides in its body and x the coordinate of the slide (the
// displacement of a steering rack). The force along d is 2 L lambda, positive when the rod is pulled.
// Coordinates: those of r_i, x, those of r_j. Numbers: L [m], then those of the points.
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/body_direction.h"
#include "costate/element/point/spatial_point.h"

namespace costate {

class TieRodConstraint final : public ConstraintOf<TieRodConstraint> {
 public:
  TieRodConstraint(std::string name, SpatialPoint sliding, int slide, SpatialPoint to, int length_number,
                   const Vector3& direction);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return "length"; }

  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    S i[3], j[3], u[3], d[3];
    const S s[3] = {S(direction_[0]), S(direction_[1]), S(direction_[2])};
    const int n = i_.size();
    i_.position(q, p + 1, i);
    j_.position(q + n + 1, p + 4, j);
    u_.value(q + (n > 0 ? SpatialPoint::curvature_index : 0), s, u);
    for (int k = 0; k < 3; ++k) d[k] = j[k] - i[k] - q[n] * u[k];
    phi[0] = dot3(d, d) - p[0] * p[0];
  }
  std::vector<Measure> measures() const override { return {{"tension", "N", true}}; }
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

 private:
  using Row = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 2 * SpatialPoint::kMaxCoordinates + 1>;
  struct Motion;
  SpatialPoint i_, j_;
  BodyDirection u_;
  Vector3 direction_;
};

}  // namespace costate
