#include "costate/element/constraint/coupling.h"

namespace costate {

CouplingConstraint::CouplingConstraint(std::string kind, std::string name, int first, int second, double factor,
                                       int ratio_number, int offset_number, std::string reaction_unit)
    : ConstraintOf(std::move(kind), std::move(name)), factor_(factor), reaction_unit_(std::move(reaction_unit)) {
  append_coordinates({first, second});
  append_numbers({ratio_number, offset_number});
}

void CouplingConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  phi_q(0, 0) = -factor_ * s.p[0];
  phi_q(0, 1) = 1;
}

void CouplingConstraint::calc_number_partial(const LocalState& s, int number, double* phi_p, double* phid_p,
                                             double* phidd_p, double* reaction_p) const {
  if (number == 1) {
    phi_p[0] = -1;
    return;
  }
  phi_p[0] = -factor_ * s.q[0];
  if (s.v) phid_p[0] = -factor_ * s.v[0];
  if (s.a) phidd_p[0] = -factor_ * s.a[0];
  if (s.lambda) reaction_p[0] = -factor_ * s.lambda[0];
}

}  // namespace costate
