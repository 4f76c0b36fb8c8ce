// Second derivatives of the equations along a direction, as the change of a gradient: for the scalar
//   L = force^T (M a + Phi_q^T lambda - Q) + phi^T Phi + phid^T Phid + phidd^T Phidd + state^T f
// with fixed weights, and a variation d = (dq, dv, da, dlambda, dz, drho) of its arguments,
//   dL_x = L_xq dq + L_xv dv + L_xa da + L_xlambda dlambda + L_xz dz + L_xrho drho   for x = q, v, a, lambda,
//   z, rho.
// They come from the elements' templated physics on path duals (exact): one part of a dual number is the
// variable x, the other one the direction (lib/README.md (13)).
#pragma once

#include "costate/assembly/assembly.h"
#include "costate/assembly/variation.h"

namespace costate {

/// n, m, m, m and nz entries; null: zero.
struct TermWeights {
  const double* force = nullptr;
  const double *phi = nullptr, *phid = nullptr, *phidd = nullptr;
  const double* state = nullptr;
};

/// Where the changes are added: n, n, n, m, nz and np entries; and one by time, of the forces' explicit dependence on
/// it, where that is asked for.
struct GradientTarget {
  double *q, *v, *a, *lambda, *z, *rho, *t = nullptr;
};

/// out += dL_x along d at the state s, which holds all of q, v, a, lambda and z.
void add_gradient_change(const Assembly& assembly, const StateView& s, const Variation& d, const TermWeights& weights,
                         const GradientTarget& out);

/// The kinetic energy T = v^T M v / 2: its change along d, and out += factor dT_x for x = q, v, rho.
double kinetic_energy_change(const StateView& s, const Assembly& assembly, const Variation& d);
void add_kinetic_energy_gradient_change(const StateView& s, const Assembly& assembly, const Variation& d, double factor,
                                        const GradientTarget& out);

/// What a change drho of the parameters makes of all numbers of the mechanism.
void calc_number_changes(const Assembly& assembly, const double* drho, std::vector<double>& out);

/// What a number changes a sum by, in terms of the parameters that it is made of.
inline void add_number(const Assembly& assembly, int number, double x, double* rho) {
  for (const auto& [column, f] : assembly.number_columns()[static_cast<std::size_t>(number)]) rho[column] += f * x;
}
inline bool varies(const Assembly& assembly, int number) {
  return !assembly.number_columns()[static_cast<std::size_t>(number)].empty();
}

}  // namespace costate
