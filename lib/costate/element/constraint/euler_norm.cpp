#include "costate/element/constraint/euler_norm.h"

namespace costate {

EulerNormConstraint::EulerNormConstraint(std::string kind, std::string name, const std::vector<int>& coordinates)
    : ConstraintOf(std::move(kind), std::move(name)) {
  append_coordinates(coordinates);
}

void EulerNormConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  for (int i = 0; i < 4; ++i) phi_q(0, i) = 2 * s.q[i];
}

void EulerNormConstraint::calc_bias(const LocalState& s, double* bias) const {
  for (int i = 0; i < 4; ++i) bias[0] += 2 * s.v[i] * s.v[i];
}

void EulerNormConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  for (int i = 0; i < 4; ++i) hessian(i, i) = 2 * s.lambda[0];
}

void EulerNormConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                        LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  for (int i = 0; i < 4; ++i) {
    phid_q(0, i) = 2 * s.v[i];
    phidd_q(0, i) = 2 * s.a[i];
  }
}

}  // namespace costate
