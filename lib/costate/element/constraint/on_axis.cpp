#include "costate/element/constraint/on_axis.h"

namespace costate {

namespace {
struct Pair {
  Vector3 b[2];
  Pair(const double* axis, int k) { perpendicular_units(axis, k, b[0].data(), b[1].data()); }
};
}  // namespace

OnAxisConstraint::OnAxisConstraint(std::string kind, std::string name, SpatialVector d,
                                   const std::vector<int>& axis_numbers, const Vector3& first_axis)
    : ConstraintOf(std::move(kind), std::move(name)), offset_(std::move(d)), across_(coordinate_across(first_axis)) {
  append_coordinates(offset_.vector().coordinates());
  append_numbers(axis_numbers);
  append_numbers(offset_.vector().numbers());
}

template <class S>
S OnAxisConstraint::measured(int i, const MeasureArgumentsOf<S>& x) const {
  using std::sqrt;
  if (i == 0) return offset_.value(x.q, x.p + 3, x.p) / sqrt(dot3(x.p, x.p));
  S b[2][3], sum(0.0);
  perpendicular_units(x.p, across_, b[0], b[1]);
  for (int k = 0; k < 2; ++k) {
    S u[3];
    offset_.direction(x.q, b[k], u);
    sum += x.lambda[k] * u[i - 1];
  }
  return sum;
}

PathDual OnAxisConstraint::measure(int i, const MeasureArguments& x) const { return measured(i, x); }

bool OnAxisConstraint::measure_value(int i, const ValueArguments& x, double& value) const {
  value = measured(i, x);
  return true;
}

void OnAxisConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const Pair c(s.p, across_);
  for (int k = 0; k < 2; ++k) phi_q.row(k) = offset_.gradient(s.q, s.p + 3, c.b[k]);
}

void OnAxisConstraint::calc_bias(const LocalState& s, double* bias) const {
  const Pair c(s.p, across_);
  for (int k = 0; k < 2; ++k) bias[k] = offset_.bias(s.q, s.v, s.p + 3, c.b[k]);
}

void OnAxisConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const Pair c(s.p, across_);
  for (int k = 0; k < 2; ++k) offset_.add_hessian(s.lambda[k], s.q, s.p + 3, c.b[k], hessian);
}

void OnAxisConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                     LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const Pair c(s.p, across_);
  BodyOffset::Row rate_q, acceleration_q;
  for (int k = 0; k < 2; ++k) {
    offset_.partials(s.q, s.v, s.a, s.p + 3, c.b[k], rate_q, acceleration_q);
    phid_q.row(k) = rate_q;
    phidd_q.row(k) = acceleration_q;
  }
}

}  // namespace costate
