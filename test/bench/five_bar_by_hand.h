// The same five-bar as one would write it for this one problem on CVODES, without a library in between: the baseline
// that general code is measured against. Baumgarte's stabilisation, accelerations from a dense 10 x 10 system, dense
// hand-written Jacobians f_y and f_rho, the continuous adjoint with f_y^T, no checkpoint but the first (3000 steps are
// stored). It reads no scene, sizes nothing and checks little; nothing of it serves another mechanism.
#pragma once

#include <vector>

namespace costate::bench {

struct ByHandResult {
  double psi = 0;
  std::vector<double> gradient;  // empty for a plain simulation
  long steps = 0, backward_steps = 0, evaluations = 0, jacobians = 0;
};

enum class Multistep { adams, bdf };

/// psi alone, and psi with its gradient by the adjoint; rtol is the absolute tolerance as well.
ByHandResult simulate_by_hand(double rtol, Multistep method);
ByHandResult gradient_by_hand(double rtol, Multistep method);

/// The same gradient on IDAS, from the residual of index 1.
ByHandResult gradient_by_idas(double rtol);
/// And by TSAdjoint of PETSc, the discrete adjoint of an explicit Runge-Kutta scheme (its names: "5dp", "8vr"); only
/// where COSTATE_BENCH_PETSC is defined.
ByHandResult gradient_by_petsc(double rtol, const char* scheme);

}  // namespace costate::bench
