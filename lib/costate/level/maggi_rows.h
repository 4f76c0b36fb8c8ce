// Rows that come and go (element/switched_rows.h) in Maggi's equations. y keeps its length, the freedoms f with all of
// them open. Where c of them are there f - c coordinates are independent, and the last c entries of y are the places at
// which these rows are kept, in their order: 0 of a gap, of a row that sticks wherever it is the value that it has
// since then. Nothing moves there, y' = yd = 0, but a place depends on the parameters as the state did in which the
// contact came to stick. A contact that slides has a reaction that depends on another one, lambda_t = -s mu lambda_n:
//   M a + Phi_r^T lambda = Q      (assembly/friction_rows.h), so that R^T in front of the equations of motion is that
//   of
// [Phi_r; B_r]^-1 = [S_r R_r], and the multipliers are those of S_r (lib/README.md (5.14)).
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/friction_rows.h"

namespace costate {

struct MaggiRows {
  /// Those that come and go and are there, and along which of them contacts slide, with the direction; in space, where
  /// it turns within a mode, 0.
  std::vector<int> there;
  std::vector<std::pair<int, double>> slides;
  /// Of those that are there the ones that depend on the others, as the second corner of a body that sticks does: the
  /// chart is without them, and their multipliers are 0 in it. Those that it has, one a place; and all that it has not.
  std::vector<int> left_out, closed, absent;
  /// Whether these are the same modes of contacts.
  bool same_modes(const MaggiRows& other) const { return there == other.there && slides == other.slides; }
};

/// The rows of a mechanism that come and go.
std::vector<int> find_switched_rows(const Assembly& assembly);
/// What the assembly has of them at its last evaluation: `left_out` is to be found, or taken from others.
MaggiRows rows_there(const Assembly& assembly, const std::vector<int>& switched);
/// Sets what is left out, at the Jacobian that the assembly has: gaps stay rather than what sticks.
void find_dependent_rows(const Assembly& assembly, const std::vector<int>& switched, MaggiRows& rows);
void leave_out(const std::vector<int>& left_out, const std::vector<int>& switched, MaggiRows& rows);
/// Freedoms with all rows that come and go open. Throws CapabilityError where others depend on each other.
int open_freedoms(Assembly& assembly);

// Places of rows that stick wherever they are, at the q, v and z of a state, whose z says which rows are there; weights
// and columns stand where y has its places, `places` entries of them behind each other.
/// Their values.
void read_places(Assembly& assembly, const StateView& s, const std::vector<int>& closed, double* places);
/// J dq + phi_rho drho, column by column.
void push_places(Assembly& assembly, const StateView& s, const std::vector<int>& closed, const double* const* dq,
                 double* const* out, int count);
/// w_q += J^T mu; gradient += mu^T phi_rho.
void pull_places(Assembly& assembly, const StateView& s, const std::vector<int>& closed, const double* mu, double* w_q,
                 double* gradient);

}  // namespace costate
