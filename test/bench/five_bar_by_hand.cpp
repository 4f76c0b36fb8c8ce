#include "five_bar_by_hand.h"

#include <cvodes/cvodes.h>

#include <algorithm>
#include <array>

#include "by_hand_sundials.h"
#include "five_bar_equations.h"

namespace costate::bench {

namespace {

using by_hand::DenseSolver, by_hand::State, by_hand::numbers, by_hand::require;
using by_hand::FiveBar, by_hand::kParameters, by_hand::kQ, by_hand::kStart, by_hand::kState, by_hand::kTEnd;
constexpr int kStoredSteps = 3000;

FiveBar& model(void* p) { return *static_cast<FiveBar*>(p); }

int rhs(double, N_Vector y, N_Vector f, void* p) {
  model(p).rhs(numbers(y), numbers(f));
  return 0;
}
int jacobian(double, N_Vector y, N_Vector, SUNMatrix J, void* p, N_Vector, N_Vector, N_Vector) {
  const auto& f_y = model(p).jacobian(numbers(y), false);
  for (int j = 0; j < kState; ++j) std::copy(f_y[j].begin(), f_y[j].end(), SM_COLUMN_D(J, j));
  return 0;
}
int cost(double, N_Vector y, N_Vector q, void*) {
  const double dx = numbers(y)[2] - kStart[2], dy = numbers(y)[3] - kStart[3];
  numbers(q)[0] = dx * dx + dy * dy;
  return 0;
}
int backward_rhs(double, N_Vector y, N_Vector mu, N_Vector f, void* p) {
  const auto& f_y = model(p).jacobian(numbers(y), false);
  for (int j = 0; j < kState; ++j) {
    double sum = 0;
    for (int i = 0; i < kState; ++i) sum += f_y[j][i] * numbers(mu)[i];
    numbers(f)[j] = -sum;
  }
  for (int i = 2; i < 4; ++i) numbers(f)[i] -= 2 * (numbers(y)[i] - kStart[i]);
  return 0;
}
int backward_jacobian(double, N_Vector y, N_Vector, N_Vector, SUNMatrix J, void* p, N_Vector, N_Vector, N_Vector) {
  const auto& f_y = model(p).jacobian(numbers(y), false);
  for (int j = 0; j < kState; ++j)
    for (int i = 0; i < kState; ++i) SM_ELEMENT_D(J, j, i) = -f_y[j][i];
  return 0;
}
int backward_quadrature(double, N_Vector y, N_Vector mu, N_Vector q, void* p) {
  model(p).jacobian(numbers(y), true);
  for (int s = 0; s < kParameters; ++s) {
    double sum = 0;
    for (int i = 0; i < kQ; ++i) sum += model(p).columns()[s][i] * numbers(mu)[kQ + i];
    numbers(q)[s] = -sum;
  }
  return 0;
}

struct Memory {
  void* cvode;
  Memory(int method, SUNContext context) : cvode(CVodeCreate(method, context)) {}
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  ~Memory() { CVodeFree(&cvode); }
};

ByHandResult run(double rtol, Multistep multistep, bool with_gradient) {
  const int method = multistep == Multistep::adams ? CV_ADAMS : CV_BDF;
  FiveBar five_bar;
  ByHandResult result;
  const Context context;
  const State y(kState, context), q(1, context), mu(kState, context), gradient(kParameters, context);
  const DenseSolver linear(kState, y, context), backward_linear(kState, mu, context);
  const Memory memory(method, context);
  void* m = memory.cvode;
  std::copy(kStart.begin(), kStart.end(), numbers(y));
  require(CVodeInit(m, rhs, 0, y), "CVodeInit");
  require(CVodeSetUserData(m, &five_bar), "CVodeSetUserData");
  require(CVodeSStolerances(m, rtol, rtol), "CVodeSStolerances");
  require(CVodeSetMaxNumSteps(m, 1'000'000), "CVodeSetMaxNumSteps");
  require(CVodeSetLinearSolver(m, linear.solver, linear.matrix), "CVodeSetLinearSolver");
  require(CVodeSetJacFn(m, jacobian), "CVodeSetJacFn");
  require(CVodeQuadInit(m, cost, q), "CVodeQuadInit");
  require(CVodeQuadSStolerances(m, rtol, rtol), "CVodeQuadSStolerances");
  require(CVodeSetQuadErrCon(m, SUNTRUE), "CVodeSetQuadErrCon");
  double t = 0;
  if (with_gradient) {
    int checkpoints = 0;
    require(CVodeAdjInit(m, kStoredSteps, CV_POLYNOMIAL), "CVodeAdjInit");
    require(CVodeF(m, kTEnd, y, &t, CV_NORMAL, &checkpoints), "CVodeF");
  } else {
    require(CVode(m, kTEnd, y, &t, CV_NORMAL), "CVode");
  }
  require(CVodeGetQuad(m, &t, q), "CVodeGetQuad");
  result.psi = numbers(q)[0];
  CVodeGetNumSteps(m, &result.steps);
  if (with_gradient) {
    int which = 0;
    require(CVodeCreateB(m, method, &which), "CVodeCreateB");
    require(CVodeInitB(m, which, backward_rhs, kTEnd, mu), "CVodeInitB");
    require(CVodeSetUserDataB(m, which, &five_bar), "CVodeSetUserDataB");
    require(CVodeSStolerancesB(m, which, rtol, rtol), "CVodeSStolerancesB");
    require(CVodeSetMaxNumStepsB(m, which, 1'000'000), "CVodeSetMaxNumStepsB");
    require(CVodeSetLinearSolverB(m, which, backward_linear.solver, backward_linear.matrix), "CVodeSetLinearSolverB");
    require(CVodeSetJacFnB(m, which, backward_jacobian), "CVodeSetJacFnB");
    require(CVodeQuadInitB(m, which, backward_quadrature, gradient), "CVodeQuadInitB");
    require(CVodeQuadSStolerancesB(m, which, rtol, rtol), "CVodeQuadSStolerancesB");
    require(CVodeSetQuadErrConB(m, which, SUNTRUE), "CVodeSetQuadErrConB");
    require(CVodeB(m, 0, CV_NORMAL), "CVodeB");
    require(CVodeGetQuadB(m, which, &t, gradient), "CVodeGetQuadB");
    CVodeGetNumSteps(CVodeGetAdjCVodeBmem(m, which), &result.backward_steps);
    result.gradient.assign(numbers(gradient), numbers(gradient) + kParameters);
  }
  result.evaluations = five_bar.evaluations;
  result.jacobians = five_bar.jacobians;
  return result;
}

}  // namespace

ByHandResult simulate_by_hand(double rtol, Multistep method) { return run(rtol, method, false); }
ByHandResult gradient_by_hand(double rtol, Multistep method) { return run(rtol, method, true); }

}  // namespace costate::bench
