// On PETSc: the right-hand side by hand with its Jacobian, an explicit Runge-Kutta scheme with its step control, the
// trajectory with its stages in memory, TSAdjoint back over the accepted steps. The cost and the two parameters are
// unknowns like the others: with a quadrature TS (of PETSc 3.18) rejected steps spoiled psi, and by TSSetRHSJacobianP
// the gradient's error was of first order in the step.
#ifdef COSTATE_BENCH_PETSC
#include <petscts.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "costate/base/error.h"
#include "five_bar_by_hand.h"
#include "five_bar_equations.h"

namespace costate::bench {

namespace {

namespace ts_hand = by_hand;
using ts_hand::kParameters, ts_hand::kQ, ts_hand::kState;
constexpr int kWithCost = kState + 1, kAll = kWithCost + kParameters;

void petsc(PetscErrorCode code) {
  if (code) throw SolverError("The five-bar on PETSc: error " + std::to_string(static_cast<int>(code)) + ".");
}

/// Once for the program; MPI alone, with one rank.
void begin_petsc() {
  static const bool begun = [] {
    petsc(PetscInitializeNoArguments());
    petsc(PetscPopSignalHandler());
    petsc(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
    std::atexit([] { static_cast<void>(PetscFinalize()); });
    return true;
  }();
  static_cast<void>(begun);
}

struct Read {
  Vec v;
  const double* x = nullptr;
  explicit Read(Vec vec) : v(vec) { petsc(VecGetArrayRead(v, &x)); }
  Read(const Read&) = delete;
  Read& operator=(const Read&) = delete;
  ~Read() { static_cast<void>(VecRestoreArrayRead(v, &x)); }
};
struct Write {
  Vec v;
  double* x = nullptr;
  explicit Write(Vec vec) : v(vec) { petsc(VecGetArray(v, &x)); }
  Write(const Write&) = delete;
  Write& operator=(const Write&) = delete;
  ~Write() { static_cast<void>(VecRestoreArray(v, &x)); }
};
struct WriteMatrix {
  Mat m;
  double* x = nullptr;  // by columns
  explicit WriteMatrix(Mat mat) : m(mat) { petsc(MatDenseGetArray(m, &x)); }
  WriteMatrix(const WriteMatrix&) = delete;
  WriteMatrix& operator=(const WriteMatrix&) = delete;
  ~WriteMatrix() {
    static_cast<void>(MatDenseRestoreArray(m, &x));
    static_cast<void>(MatAssemblyBegin(m, MAT_FINAL_ASSEMBLY));
    static_cast<void>(MatAssemblyEnd(m, MAT_FINAL_ASSEMBLY));
  }
};

ts_hand::FiveBar& ts_model(void* p) { return *static_cast<ts_hand::FiveBar*>(p); }

PetscErrorCode ts_rhs(TS, PetscReal, Vec y, Vec f, void* p) {
  const Read in(y);
  const Write out(f);
  ts_model(p).rhs(in.x, out.x);
  const double dx = in.x[2] - ts_hand::kStart[2], dy = in.x[3] - ts_hand::kStart[3];
  out.x[kState] = dx * dx + dy * dy;
  std::fill_n(out.x + kWithCost, kParameters, 0.0);
  return 0;
}
PetscErrorCode ts_jacobian(TS, PetscReal, Vec y, Mat J, Mat, void* p) {
  const Read in(y);
  const auto& f_y = ts_model(p).jacobian(in.x, true);
  const WriteMatrix out(J);
  std::fill_n(out.x, kAll * kAll, 0.0);
  for (int j = 0; j < kState; ++j) std::copy(f_y[j].begin(), f_y[j].end(), out.x + j * kAll);
  for (int i = 2; i < 4; ++i) out.x[i * kAll + kState] = 2 * (in.x[i] - ts_hand::kStart[i]);
  for (int s = 0; s < kParameters; ++s)
    std::copy_n(ts_model(p).columns()[s].begin(), kQ, out.x + (kWithCost + s) * kAll + kQ);
  return 0;
}

struct Objects {
  TS ts = nullptr;
  Vec y = nullptr, mu = nullptr;
  Mat f_y = nullptr;
  Objects() = default;
  Objects(const Objects&) = delete;
  Objects& operator=(const Objects&) = delete;
  ~Objects() {
    static_cast<void>(TSDestroy(&ts));
    for (Vec* v : {&y, &mu}) static_cast<void>(VecDestroy(v));
    static_cast<void>(MatDestroy(&f_y));
  }
};

}  // namespace

ByHandResult gradient_by_petsc(double rtol, const char* scheme) {
  begin_petsc();
  ts_hand::FiveBar model;
  ByHandResult result;
  Objects o;
  const MPI_Comm self = PETSC_COMM_SELF;
  petsc(VecCreateSeq(self, kAll, &o.y));
  petsc(VecCreateSeq(self, kAll, &o.mu));
  petsc(MatCreateSeqDense(self, kAll, kAll, nullptr, &o.f_y));
  petsc(TSCreate(self, &o.ts));
  petsc(TSSetProblemType(o.ts, TS_NONLINEAR));
  petsc(TSSetType(o.ts, TSRK));
  petsc(TSRKSetType(o.ts, scheme));
  petsc(TSSetRHSFunction(o.ts, nullptr, ts_rhs, &model));
  petsc(TSSetRHSJacobian(o.ts, o.f_y, o.f_y, ts_jacobian, &model));
  petsc(TSSetMaxTime(o.ts, ts_hand::kTEnd));
  petsc(TSSetMaxSteps(o.ts, 1'000'000));
  petsc(TSSetExactFinalTime(o.ts, TS_EXACTFINALTIME_MATCHSTEP));
  petsc(TSSetTimeStep(o.ts, 1e-3));
  petsc(TSSetTolerances(o.ts, rtol, nullptr, rtol, nullptr));
  petsc(TSSetSaveTrajectory(o.ts));
  TSTrajectory trajectory = nullptr;
  petsc(TSGetTrajectory(o.ts, &trajectory));
  petsc(TSTrajectorySetType(trajectory, o.ts, TSTRAJECTORYMEMORY));
  petsc(TSTrajectorySetSolutionOnly(trajectory, PETSC_FALSE));
  {
    const Write start(o.y);
    std::fill_n(start.x, kAll, 0.0);
    std::copy(ts_hand::kStart.begin(), ts_hand::kStart.end(), start.x);
  }
  petsc(TSSolve(o.ts, o.y));
  PetscInt steps = 0;
  petsc(TSGetStepNumber(o.ts, &steps));
  result.steps = result.backward_steps = steps;
  result.psi = Read(o.y).x[kState];
  petsc(VecSet(o.mu, 0));
  Write(o.mu).x[kState] = 1;
  petsc(TSSetCostGradients(o.ts, 1, &o.mu, nullptr));
  petsc(TSAdjointSolve(o.ts));
  const Read mu(o.mu);
  result.gradient.assign(mu.x + kWithCost, mu.x + kAll);
  result.evaluations = model.evaluations;
  result.jacobians = model.jacobians;
  return result;
}

}  // namespace costate::bench
#endif
