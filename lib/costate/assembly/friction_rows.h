// Rows of contacts that slide (element/switched_rows.h) without multipliers of their own: friction is
// lambda_t = -s mu lambda_n, and what acts on the mechanism with lambda_n is
//   M a + Phi_r^T lambda = Q,  Phi_r = Phi_q,n - s mu Phi_q,t in the row of its gap,
// in space Phi_q,n - mu sum_k sigma_k Phi_q,t_k.
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

/// rows -= s mu of the rows `along` in which contacts slide, in those of their gaps; both on the pattern of Phi_q.
void add_friction_rows(const Assembly& assembly, const std::vector<double>& along, std::vector<double>& rows);
/// Phi_r of the assembly's last evaluation, on the pattern of Phi_q.
void calc_reaction_rows(const Assembly& assembly, std::vector<double>& phi_r);
/// lambda along the rows in which contacts slide, of those of their gaps.
void add_friction_multipliers(const Assembly& assembly, double* lambda);
/// Of weights of multipliers those of friction go over to the normal forces: the transpose of that.
void pull_friction_multipliers(const Assembly& assembly, double* weights);

}  // namespace costate
