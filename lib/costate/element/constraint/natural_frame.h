// Keeps the base vectors of a body in natural coordinates of length 1 and perpendicular: u1.u1 - 1, u2.u2 -
// 1, u3.u3 - 1, u2.u3, u3.u1, u1.u2. Quadratic, so that Phid_q = Phi_q(v) and Phidd_q = Phi_q(a).
#pragma once

#include "costate/element/element.h"

namespace costate {

class NaturalFrameConstraint final : public ConstraintOf<NaturalFrameConstraint> {
 public:
  /// coordinates: u1x, u1y, u1z, u2x, ..., u3z.
  NaturalFrameConstraint(std::string kind, std::string name, const std::vector<int>& coordinates);

  int rows() const override { return 6; }
  std::string row_name(int i) const override;

  template <class S>
  void physics(const S&, const S* q, const S*, S* phi) const {
    for (int r = 0; r < 6; ++r) {
      const S *a = q + 3 * kPair[r][0], *b = q + 3 * kPair[r][1];
      phi[r] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      if (r < 3) phi[r] -= S(1.0);
    }
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override { gradient(s.q, phi_q); }
  void calc_phi_t(const LocalState&, double*) const override {}
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override;
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override;

 private:
  static constexpr int kPair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {2, 0}, {0, 1}};
  static void gradient(const double* x, LocalMatrix& out);
};

}  // namespace costate
