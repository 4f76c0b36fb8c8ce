// The explicit dependence of the equations on time, at everything else fixed: laws of drivers, of forces and of grounds
// that move. Who takes steps whose ends follow the parameters needs it there (discrete/step_length.h). It comes from
// the elements' templated physics on path duals (exact).
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

struct TimePartials {
  std::vector<double> force;             // (Phi_q^T lambda - Q)_t, n
  std::vector<double> state;             // f_t, nz
  std::vector<double> phi, phid, phidd;  // Phi_t, (Phid)_t, (Phidd)_t, m; 0 of rows that are not there
};
/// At (t, q, v, a, lambda, z), with the rows that were there at the last evaluation.
void calc_time_partials(const Assembly& assembly, const StateView& s, TimePartials& out);

/// (Phi_q^T gamma)_t at (t, q), for gamma of m entries; out has n.
void calc_reaction_time_partial(const Assembly& assembly, const StateView& s, const double* gamma,
                                std::vector<double>& out);

}  // namespace costate
