#include "costate/integrator/solved_algebraic.h"

#include <algorithm>

#include "costate/formulation/solved_state.h"

namespace costate {

namespace {

/// The first acceleration's index among the unknowns (q, v, z, a, lambda, stabilizers), or -1 where they are in the
/// norm.
int unweighted_accelerations(const DaeSystem& system) {
  const int n = system.assembly().n(), m = system.assembly().m();
  const auto& unknowns = system.unknowns();
  if (!system.begins_with_motion() || n == 0) return -1;
  const auto first = std::find_if(unknowns.begin(), unknowns.end(),
                                  [](const Unknown& u) { return u.role == Unknown::Role::acceleration; });
  const auto at = static_cast<int>(first - unknowns.begin());
  return first != unknowns.end() && !first->in_norm && at + n + m <= system.size() ? at : -1;
}

}  // namespace

void solve_algebraic(DaeSystem& system, double t, double* y) {
  const int first = unweighted_accelerations(system);
  if (first < 0) return;
  const int n = system.assembly().n(), m = system.assembly().m();
  const MechanismState s = solved_state(system, t, y);
  std::copy(s.a, s.a + n, y + first);
  std::copy(s.lambda, s.lambda + m, y + first + n);
  std::fill(y + first + n + m, y + system.size(), 0.0);
}

const double* SolvedAlgebraic::at(DaeSystem& system, double t, const double* y) {
  if (t == t_) return y_.data();
  forget();
  const bool unweighted = unweighted_accelerations(system) >= 0;
  auto* solving = dynamic_cast<SolvedState*>(&system);
  if (!unweighted && !solving) return y;
  y_.assign(y, y + system.size());
  if (unweighted)
    solve_algebraic(system, t, y_.data());
  else
    solving->solve_unknowns(t, y_.data());
  t_ = t;
  return y_.data();
}

}  // namespace costate
