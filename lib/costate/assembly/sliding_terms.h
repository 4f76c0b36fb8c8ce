// Second derivatives of the rows along which contacts slide (element/switched_rows.h), and their rates along the
// motion: of R2_k = -(lambda_k + mu lambda_0 sigma_k), in space with a sigma that turns (slip_turn.h).
#pragma once

#include "costate/assembly/second_terms.h"

namespace costate {

/// -s2^T R2 of these rows, s2 of all m: out += the change of its gradient along d at fixed s2; at the directions that
/// the assembly has.
void add_sliding_gradient_change(const Assembly& assembly, const StateView& s, const Variation& d, const double* s2,
                                 const GradientTarget& out);
/// R2_k' of these rows at lambda' = 0 along the motion, in `row` (m).
void add_sliding_rates(const Assembly& assembly, const StateView& s, double* row);

/// The entries -(mu sigma_k)' of the rows' derivatives by their normal multipliers, along the motion, on this pattern;
/// empty where nothing slides in space.
std::vector<double> slip_corner_rates(const Assembly& assembly, const StateView& s, const SparsePattern& corner);
/// The same of rows with which multipliers act (friction_rows.h): rows -= (mu sigma_k)' J_t,k in those of the gaps.
void add_turning_friction(const Assembly& assembly, const StateView& s, std::vector<double>& rows);

}  // namespace costate
