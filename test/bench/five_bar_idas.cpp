// On IDAS: y = (q, v, a, lambda), index 1 with the same stabilisation, 22 unknowns and dense matrices; the continuous
// adjoint E^T mu' - F_y^T mu + g_y = 0, its gradient the integral of mu^T dQ/drho.
#include <idas/idas.h>

#include <algorithm>

#include "by_hand_sundials.h"
#include "five_bar_by_hand.h"
#include "five_bar_equations.h"

namespace costate::bench {

namespace {

namespace hand = by_hand;
using hand::kKkt, hand::kQ, hand::kRows, hand::kState;
constexpr int kUnknowns = kState + kKkt, kKeptSteps = 5000;

using Dense = hand::Table<kUnknowns, kUnknowns>;  // by columns

struct IdasModel {
  hand::FiveBar five_bar;
  Dense f_y{};

  /// F_y by columns.
  void derive(const double* y) {
    hand::FiveBar::Derivatives c{};
    five_bar.rows_derivatives(y, y + kState, c);
    for (auto& column : f_y) column.fill(0);
    for (int j = 0; j < kState; ++j)
      for (int i = 0; i < kKkt; ++i) f_y[j][kState + i] = -c[j][i];
    for (int i = 0; i < kState; ++i) f_y[kQ + i][i] = -1;  // q' - v, v' - a
    for (int i = 0; i < kQ; ++i) {
      for (int j = 0; j < kQ; ++j) f_y[kState + j][kState + i] = five_bar.mass()[i][j];
      for (int r = 0; r < kRows; ++r)
        f_y[kState + kQ + r][kState + i] = f_y[kState + i][kState + kQ + r] = five_bar.phi_q()[r][i];
    }
  }
};
IdasModel& idas_model(void* p) { return *static_cast<IdasModel*>(p); }

int residual(double, N_Vector y, N_Vector yp, N_Vector r, void* p) {
  const double *u = hand::numbers(y), *up = hand::numbers(yp);
  for (int i = 0; i < kState; ++i) hand::numbers(r)[i] = up[i] - u[kQ + i];
  idas_model(p).five_bar.rows(u, u + kState, hand::numbers(r) + kState);
  return 0;
}
int residual_jacobian(double, double cj, N_Vector y, N_Vector, N_Vector, SUNMatrix J, void* p, N_Vector, N_Vector,
                      N_Vector) {
  IdasModel& m = idas_model(p);
  m.derive(hand::numbers(y));
  for (int j = 0; j < kUnknowns; ++j) {
    std::copy(m.f_y[j].begin(), m.f_y[j].end(), SM_COLUMN_D(J, j));
    if (j < kState) SM_ELEMENT_D(J, j, j) += cj;
  }
  return 0;
}
int running_cost(double, N_Vector y, N_Vector, N_Vector q, void*) {
  const double dx = hand::numbers(y)[2] - hand::kStart[2], dy = hand::numbers(y)[3] - hand::kStart[3];
  hand::numbers(q)[0] = dx * dx + dy * dy;
  return 0;
}
int backward_residual(double, N_Vector y, N_Vector, N_Vector mu, N_Vector mup, N_Vector r, void* p) {
  IdasModel& m = idas_model(p);
  m.derive(hand::numbers(y));
  for (int j = 0; j < kUnknowns; ++j) {
    double sum = j < kState ? hand::numbers(mup)[j] : 0;
    for (int i = 0; i < kUnknowns; ++i) sum -= m.f_y[j][i] * hand::numbers(mu)[i];
    hand::numbers(r)[j] = sum;
  }
  for (int i = 2; i < 4; ++i) hand::numbers(r)[i] += 2 * (hand::numbers(y)[i] - hand::kStart[i]);
  return 0;
}
int backward_residual_jacobian(double, double cj, N_Vector y, N_Vector, N_Vector, N_Vector, N_Vector, SUNMatrix J,
                               void* p, N_Vector, N_Vector, N_Vector) {
  IdasModel& m = idas_model(p);
  m.derive(hand::numbers(y));
  for (int i = 0; i < kUnknowns; ++i)
    for (int j = 0; j < kUnknowns; ++j) SM_ELEMENT_D(J, i, j) = (i == j && i < kState ? cj : 0) - m.f_y[i][j];
  return 0;
}
int gradient_rate(double, N_Vector y, N_Vector, N_Vector mu, N_Vector, N_Vector q, void*) {
  for (int s = 0; s < hand::kParameters; ++s) {
    const auto force = hand::FiveBar::force_by_length(hand::numbers(y), s);
    hand::numbers(q)[s] = -force[0] * hand::numbers(mu)[kState + 2] - force[1] * hand::numbers(mu)[kState + 3];
  }
  return 0;
}

struct IdasMemory {
  void* ida;
  explicit IdasMemory(SUNContext context) : ida(IDACreate(context)) {}
  IdasMemory(const IdasMemory&) = delete;
  IdasMemory& operator=(const IdasMemory&) = delete;
  ~IdasMemory() { IDAFree(&ida); }
};

}  // namespace

ByHandResult gradient_by_idas(double rtol) {
  using hand::numbers, hand::require, hand::State;
  IdasModel model;
  ByHandResult result;
  const Context context;
  const State y(kUnknowns, context), yp(kUnknowns, context), id(kUnknowns, context), q(1, context),
      mu(kUnknowns, context), mup(kUnknowns, context), gradient(hand::kParameters, context);
  const hand::DenseSolver linear(kUnknowns, y, context), backward_linear(kUnknowns, mu, context);
  const IdasMemory memory(context);
  void* m = memory.ida;
  std::copy(hand::kStart.begin(), hand::kStart.end(), numbers(y));
  const auto& x = model.five_bar.accelerations(numbers(y));
  std::copy(x.begin(), x.end(), numbers(y) + kState);
  std::copy_n(x.begin(), kQ, numbers(yp) + kQ);
  std::fill_n(numbers(id), kState, 1.0);
  require(IDAInit(m, residual, 0, y, yp), "IDAInit");
  require(IDASetUserData(m, &model), "IDASetUserData");
  require(IDASStolerances(m, rtol, rtol), "IDASStolerances");
  require(IDASetMaxNumSteps(m, 1'000'000), "IDASetMaxNumSteps");
  require(IDASetId(m, id), "IDASetId");
  require(IDASetSuppressAlg(m, SUNTRUE), "IDASetSuppressAlg");
  require(IDASetLinearSolver(m, linear.solver, linear.matrix), "IDASetLinearSolver");
  require(IDASetJacFn(m, residual_jacobian), "IDASetJacFn");
  require(IDAQuadInit(m, running_cost, q), "IDAQuadInit");
  require(IDAQuadSStolerances(m, rtol, rtol), "IDAQuadSStolerances");
  require(IDASetQuadErrCon(m, SUNTRUE), "IDASetQuadErrCon");
  double t = 0;
  int checkpoints = 0, which = 0;
  require(IDAAdjInit(m, kKeptSteps, IDA_POLYNOMIAL), "IDAAdjInit");
  require(IDASolveF(m, hand::kTEnd, &t, y, yp, IDA_NORMAL, &checkpoints), "IDASolveF");
  require(IDAGetQuad(m, &t, q), "IDAGetQuad");
  result.psi = numbers(q)[0];
  IDAGetNumSteps(m, &result.steps);
  for (int i = 2; i < 4; ++i) numbers(mup)[i] = -2 * (numbers(y)[i] - hand::kStart[i]);  // mu = 0: consistent
  require(IDACreateB(m, &which), "IDACreateB");
  require(IDAInitB(m, which, backward_residual, hand::kTEnd, mu, mup), "IDAInitB");
  require(IDASetUserDataB(m, which, &model), "IDASetUserDataB");
  require(IDASStolerancesB(m, which, rtol, rtol), "IDASStolerancesB");
  require(IDASetMaxNumStepsB(m, which, 1'000'000), "IDASetMaxNumStepsB");
  require(IDASetIdB(m, which, id), "IDASetIdB");
  require(IDASetSuppressAlgB(m, which, SUNTRUE), "IDASetSuppressAlgB");
  require(IDASetLinearSolverB(m, which, backward_linear.solver, backward_linear.matrix), "IDASetLinearSolverB");
  require(IDASetJacFnB(m, which, backward_residual_jacobian), "IDASetJacFnB");
  require(IDAQuadInitB(m, which, gradient_rate, gradient), "IDAQuadInitB");
  require(IDAQuadSStolerancesB(m, which, rtol, rtol), "IDAQuadSStolerancesB");
  require(IDASetQuadErrConB(m, which, SUNTRUE), "IDASetQuadErrConB");
  require(IDASolveB(m, 0, IDA_NORMAL), "IDASolveB");
  require(IDAGetQuadB(m, which, &t, gradient), "IDAGetQuadB");
  IDAGetNumSteps(IDAGetAdjIDABmem(m, which), &result.backward_steps);
  result.gradient.assign(numbers(gradient), numbers(gradient) + hand::kParameters);
  result.evaluations = model.five_bar.evaluations;
  result.jacobians = model.five_bar.jacobians;
  return result;
}

}  // namespace costate::bench
