#include "costate/element/constraint/offset.h"

#include "costate/element/point/number_gradient.h"

namespace costate {

namespace {
Vector3 direction(const LocalState& s) { return Vector3(s.p[0], s.p[1], s.p[2]).normalized(); }
}  // namespace

OffsetConstraint::OffsetConstraint(std::string kind, std::string name, SpatialVector d,
                                   const std::vector<int>& direction_numbers,
                                   std::optional<int> displacement_coordinate)
    : ConstraintOf(std::move(kind), std::move(name)),
      offset_(std::move(d)),
      moves_(displacement_coordinate.has_value()) {
  append_coordinates(offset_.vector().coordinates());
  if (displacement_coordinate) append_coordinates({*displacement_coordinate});
  append_numbers(direction_numbers);
  append_numbers(offset_.vector().numbers());
}

void OffsetConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const int k = offset_.size();
  phi_q.leftCols(k) = offset_.gradient(s.q, s.p + 3, direction(s));
  if (moves_) phi_q(0, k) = -1;
}

void OffsetConstraint::calc_bias(const LocalState& s, double* bias) const {
  bias[0] = offset_.bias(s.q, s.v, s.p + 3, direction(s));
}

void OffsetConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  offset_.add_hessian(s.lambda[0], s.q, s.p + 3, direction(s), hessian);
}

void OffsetConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                     LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  BodyOffset::Row rate_q, acceleration_q;
  offset_.partials(s.q, s.v, s.a, s.p + 3, direction(s), rate_q, acceleration_q);
  phid_q.leftCols(offset_.size()) = rate_q;
  phidd_q.leftCols(offset_.size()) = acceleration_q;
}

double OffsetConstraint::calc_number_gradient(const LocalState& s, int number, const ConstraintWeights& w) const {
  double by_number[3 + kMaxNumbers<SpatialVector>] = {};
  const bool reaction = w.reaction && s.lambda;
  const double weights[3] = {w.phi[0], w.phid[0], w.phidd[0]};
  const Vector3 by_direction =
      offset_.add_number_gradient(s.q, s.v, s.a, weights, reaction ? w.reaction : nullptr, reaction ? s.lambda[0] : 0,
                                  s.p + 3, direction(s), by_number + 3);
  Eigen::Map<Vector3>(by_number, 3) = axis_gradient(s.p, by_direction);
  return by_number[number];
}

}  // namespace costate
