// Keeps the Euler parameters of a rigid body normalised: phi = p.p - 1.
#pragma once

#include "costate/element/element.h"

namespace costate {

class EulerNormConstraint final : public ConstraintOf<EulerNormConstraint> {
 public:
  /// coordinates: e0, e1, e2, e3.
  EulerNormConstraint(std::string kind, std::string name, const std::vector<int>& coordinates);

  int rows() const override { return 1; }
  std::string row_name(int) const override { return "norm"; }

  template <class S>
  void physics(const S&, const S* q, const S*, S* phi) const {
    phi[0] = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - S(1.0);
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;
};

}  // namespace costate
