#include "costate/element/constraint/natural_frame.h"

namespace costate {

NaturalFrameConstraint::NaturalFrameConstraint(std::string kind, std::string name, const std::vector<int>& coordinates)
    : ConstraintOf(std::move(kind), std::move(name)) {
  append_coordinates(coordinates);
}

std::string NaturalFrameConstraint::row_name(int i) const {
  const std::string a(1, "123"[kPair[i][0]]), b(1, "123"[kPair[i][1]]);
  return i < 3 ? "length_" + a : "angle_" + a + b;
}

void NaturalFrameConstraint::gradient(const double* x, LocalMatrix& out) {
  for (int r = 0; r < 6; ++r)
    for (int i = 0; i < 3; ++i) {
      const int a = 3 * kPair[r][0] + i, b = 3 * kPair[r][1] + i;
      out(r, a) += x[b];
      out(r, b) += x[a];
    }
}

void NaturalFrameConstraint::calc_bias(const LocalState& s, double* bias) const {
  for (int r = 0; r < 6; ++r)
    for (int i = 0; i < 3; ++i) bias[r] += 2 * s.v[3 * kPair[r][0] + i] * s.v[3 * kPair[r][1] + i];
}

void NaturalFrameConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  for (int r = 0; r < 6; ++r)
    for (int i = 0; i < 3; ++i) {
      const int a = 3 * kPair[r][0] + i, b = 3 * kPair[r][1] + i;
      hessian(a, b) += s.lambda[r];
      hessian(b, a) += s.lambda[r];
    }
}

void NaturalFrameConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                           LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  gradient(s.v, phid_q);
  gradient(s.a, phidd_q);
}

}  // namespace costate
