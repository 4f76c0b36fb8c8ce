// Second derivatives of what balances impulses, M u + Phi_q^T P and Phi_q u + r Phi_t, from the elements' templates:
// one part of a dual number is the variable, another one the direction, and of constraints the path's rate a third.
#pragma once

#include <Eigen/Core>

#include "costate/assembly/second_terms.h"

namespace costate {

/// A vector that changes along the direction.
struct Changing {
  Eigen::VectorXd value, change;
};

/// Where changes of derivatives are added to: n and np entries, and that by the time itself.
struct ImpulseDerivatives {
  double *q, *rho;
  double t = 0;
};

/// out -= the change along d of the derivatives of a^T M u, by q and rho, with a and u held but for their own changes.
void add_mass_terms(const Assembly& assembly, const StateView& s, const Variation& d, const Changing& a,
                    const Changing& u, ImpulseDerivatives& out);
/// The same of w^T (Phi_q y + clock Phi_t), of the constraints that are there.
void add_row_terms(const Assembly& assembly, const StateView& s, const Variation& d, const Changing& w,
                   const Changing& y, double clock, ImpulseDerivatives& out);

/// force (n) -= the change along d of M y at fixed y, and of Phi_q^T b where b is given; row (m) -= that of Phi_q y +
/// clock Phi_t.
void subtract_mass_change(const Assembly& assembly, const StateView& s, const Variation& d, const Eigen::VectorXd& y,
                          double* force);
void subtract_row_change(const Assembly& assembly, const StateView& s, const Variation& d, const Eigen::VectorXd& y,
                         double clock, double* row, const Eigen::VectorXd* b = nullptr, double* force = nullptr);

}  // namespace costate
