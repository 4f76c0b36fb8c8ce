// The choice of independent coordinates for Maggi's equations (lib/README.md (5)): the f coordinates in which the
// others move least, so that the null space R of Phi_q with R = 1 in their rows has no entry above 1. Of few freedoms
// by full matrices, of many by sparse elimination.
#pragma once

#include <span>
#include <vector>

#include "costate/linear/sparse_pattern.h"

namespace costate {

/// Of more freedoms, without redundant rows, neither R nor R^T M R is formed.
inline constexpr int kMostFullFreedoms = 24;

/// The f = `freedoms` coordinates, in increasing order, whose rows of a null-space basis span the largest volume, as
/// far as exchanges of two find it. First guess: from a column-pivoted QR of Phi_q^T or, of more than `most_full`
/// freedoms without redundant rows, from the columns that are left when each row, the shortest first, is solved for its
/// largest one. `weight` brings coordinates of different units to one: rows of R count times weight[i], so that an
/// independent j and a dependent i compare as |R_ij| weight[i] / weight[j].
std::vector<int> choose_independent(const SparsePattern& jacobian, const double* phi_q, int freedoms,
                                    const std::vector<double>& weight, int most_full = kMostFullFreedoms);

/// Given R (n x f, columns one after the other) of the choice `independent`, exchanges independent for dependent
/// coordinates, the largest |R_ij| first, until none exceeds 1: each exchange multiplies the volume by |R_ij|. R is
/// overwritten with that of the new choice.
void improve_choice(std::vector<int>& independent, double* R, const std::vector<double>& weight);

/// The largest weighted |R_ij| of the columns of these coordinates: 1 for the best choice, infinite where the choice is
/// singular.
double worst_ratio(std::span<const int> independent, const double* R, const std::vector<double>& weight);

}  // namespace costate
