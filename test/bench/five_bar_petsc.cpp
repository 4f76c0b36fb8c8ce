// On PETSc: the right-hand side by hand with f_y and f_rho, an explicit Runge-Kutta scheme with its step control, the
// trajectory with its stages in memory, the cost by a quadrature TS, TSAdjoint back over the accepted steps.
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
  ts_model(p).rhs(Read(y).x, Write(f).x);
  return 0;
}
PetscErrorCode ts_jacobian(TS, PetscReal, Vec y, Mat J, Mat, void* p) {
  const auto& f_y = ts_model(p).jacobian(Read(y).x, true);
  const WriteMatrix out(J);
  for (int j = 0; j < kState; ++j) std::copy(f_y[j].begin(), f_y[j].end(), out.x + j * kState);
  return 0;
}
PetscErrorCode ts_jacobian_p(TS, PetscReal, Vec y, Mat J, void* p) {
  ts_model(p).jacobian(Read(y).x, true);
  const WriteMatrix out(J);
  for (int s = 0; s < kParameters; ++s) {
    std::fill_n(out.x + s * kState, kQ, 0.0);
    std::copy_n(ts_model(p).columns()[s].begin(), kQ, out.x + s * kState + kQ);
  }
  return 0;
}
PetscErrorCode ts_cost(TS, PetscReal, Vec y, Vec q, void*) {
  const Read in(y);
  const double dx = in.x[2] - ts_hand::kStart[2], dy = in.x[3] - ts_hand::kStart[3];
  Write(q).x[0] = dx * dx + dy * dy;
  return 0;
}
PetscErrorCode ts_cost_y(TS, PetscReal, Vec y, Mat J, Mat, void*) {
  const Read in(y);
  const WriteMatrix out(J);
  std::fill_n(out.x, kState, 0.0);
  for (int i = 2; i < 4; ++i) out.x[i] = 2 * (in.x[i] - ts_hand::kStart[i]);
  return 0;
}
PetscErrorCode ts_cost_p(TS, PetscReal, Vec, Mat J, void*) {
  const WriteMatrix out(J);
  std::fill_n(out.x, kParameters, 0.0);
  return 0;
}

struct Objects {  // freed in this order, those of the quadrature by the TS that owns it
  TS ts = nullptr;
  Vec y = nullptr, mu = nullptr, gradient = nullptr;
  Mat f_y = nullptr, f_rho = nullptr, g_y = nullptr, g_rho = nullptr;
  Objects() = default;
  Objects(const Objects&) = delete;
  Objects& operator=(const Objects&) = delete;
  ~Objects() {
    static_cast<void>(TSDestroy(&ts));
    for (Vec* v : {&y, &mu, &gradient}) static_cast<void>(VecDestroy(v));
    for (Mat* m : {&f_y, &f_rho, &g_y, &g_rho}) static_cast<void>(MatDestroy(m));
  }
};

}  // namespace

ByHandResult gradient_by_petsc(double rtol, const char* scheme) {
  begin_petsc();
  ts_hand::FiveBar model;
  ByHandResult result;
  Objects o;
  const MPI_Comm self = PETSC_COMM_SELF;
  petsc(VecCreateSeq(self, kState, &o.y));
  petsc(VecCreateSeq(self, kState, &o.mu));
  petsc(VecCreateSeq(self, kParameters, &o.gradient));
  petsc(MatCreateSeqDense(self, kState, kState, nullptr, &o.f_y));
  petsc(MatCreateSeqDense(self, kState, kParameters, nullptr, &o.f_rho));
  petsc(MatCreateSeqDense(self, kState, 1, nullptr, &o.g_y));
  petsc(MatCreateSeqDense(self, kParameters, 1, nullptr, &o.g_rho));
  petsc(TSCreate(self, &o.ts));
  petsc(TSSetProblemType(o.ts, TS_NONLINEAR));
  petsc(TSSetType(o.ts, TSRK));
  petsc(TSRKSetType(o.ts, scheme));
  petsc(TSSetRHSFunction(o.ts, nullptr, ts_rhs, &model));
  petsc(TSSetRHSJacobian(o.ts, o.f_y, o.f_y, ts_jacobian, &model));
  petsc(TSSetRHSJacobianP(o.ts, o.f_rho, ts_jacobian_p, &model));
  TS quadrature = nullptr;
  petsc(TSCreateQuadratureTS(o.ts, PETSC_TRUE, &quadrature));
  petsc(TSSetRHSFunction(quadrature, nullptr, ts_cost, nullptr));
  petsc(TSSetRHSJacobian(quadrature, o.g_y, o.g_y, ts_cost_y, nullptr));
  petsc(TSSetRHSJacobianP(quadrature, o.g_rho, ts_cost_p, nullptr));
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
    std::fill_n(start.x, kState, 0.0);
    std::copy(ts_hand::kStart.begin(), ts_hand::kStart.end(), start.x);
  }
  petsc(TSSolve(o.ts, o.y));
  PetscInt steps = 0;
  petsc(TSGetStepNumber(o.ts, &steps));
  result.steps = result.backward_steps = steps;
  Vec cost = nullptr;
  petsc(TSGetCostIntegral(o.ts, &cost));
  result.psi = Read(cost).x[0];
  petsc(VecSet(o.mu, 0));
  petsc(VecSet(o.gradient, 0));
  petsc(TSSetCostGradients(o.ts, 1, &o.mu, &o.gradient));
  petsc(TSAdjointSolve(o.ts));
  const Read gradient(o.gradient);
  result.gradient.assign(gradient.x, gradient.x + kParameters);
  result.evaluations = model.evaluations;
  result.jacobians = model.jacobians;
  return result;
}

}  // namespace costate::bench
#endif
