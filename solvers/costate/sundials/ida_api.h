// What IDAS and CVODES have in common, under one set of names: this is IDAS's side, cvode_api.h the other.
// integrator/sundials_session.h is written on it.
#pragma once

#include <idas/idas.h>

#include "costate/formulation/system.h"
#include "costate/sundials/message_capture.h"

namespace costate {

struct IdaApi {
  using SystemType = DaeSystem;
  using CheckpointRecord = IDAadjCheckPointRec;
  using Quadrature = IDAQuadRhsFn;
  using BackwardQuadrature = IDAQuadRhsFnB;
  static constexpr const char* name = "IDAS";
  /// Unknowns come with their derivatives y', and the first step is chosen without an evaluation.
  static constexpr bool implicit = true;

  static constexpr int too_much_work = IDA_TOO_MUCH_WORK, no_progress = IDA_ERR_FAIL;
  /// Of evaluations that could not be made, whatever the step.
  static bool is_evaluation(int flag) {
    return flag == IDA_CONV_FAIL || flag == IDA_REP_RES_ERR || flag == IDA_FIRST_RES_FAIL;
  }
  static char* flag_name(int flag) { return IDAGetReturnFlagName(flag); }  // the caller owns it
  static constexpr auto capture_messages = capture_ida_messages;

  static void free(void** m) { IDAFree(m); }
  static constexpr auto set_user_data = IDASetUserData;
  static constexpr auto set_max_steps = IDASetMaxNumSteps;
  static constexpr auto set_max_error_test_failures = IDASetMaxErrTestFails;
  static constexpr auto set_stop_time = IDASetStopTime;
  static constexpr auto set_max_step = IDASetMaxStep;
  static constexpr auto set_linear_solver = IDASetLinearSolver;
  static int init_quadrature(void* m, Quadrature f, N_Vector q) { return IDAQuadInit(m, f, q); }
  static constexpr auto set_quadrature_tolerances = IDAQuadSStolerances;
  static constexpr auto set_quadrature_error_control = IDASetQuadErrCon;
  static int init_adjoint(void* m, long steps) { return IDAAdjInit(m, steps, IDA_POLYNOMIAL); }

  static int solve(void* m, double to, double* reached, N_Vector y, N_Vector yp, bool one_step, int* checkpoints) {
    const int mode = one_step ? IDA_ONE_STEP : IDA_NORMAL;
    return checkpoints ? IDASolveF(m, to, reached, y, yp, mode, checkpoints) : IDASolve(m, to, reached, y, yp, mode);
  }
  static constexpr auto dky = IDAGetDky;
  static constexpr auto quadrature_dky = IDAGetQuadDky;
  static constexpr auto sensitivity_dky = IDAGetSensDky;
  static constexpr auto last_order = IDAGetLastOrder;
  static constexpr auto last_step = IDAGetLastStep;
  static constexpr auto current_time = IDAGetCurrentTime;
  static constexpr auto current_step = IDAGetCurrentStep;
  static constexpr auto weights = IDAGetErrWeights;
  static constexpr auto local_errors = IDAGetEstLocalErrors;
  static constexpr auto steps = IDAGetNumSteps;
  static constexpr auto evaluations = IDAGetNumResEvals;
  static constexpr auto newton_iterations = IDAGetNumNonlinSolvIters;
  static constexpr auto error_test_failures = IDAGetNumErrTestFails;
  static constexpr auto convergence_failures = IDAGetNumNonlinSolvConvFails;
  static constexpr auto sensitivity_evaluations = IDAGetSensNumResEvals;
  static constexpr auto checkpoints = IDAGetAdjCheckPointsInfo;

  static constexpr auto backward_memory = IDAGetAdjIDABmem;
  static constexpr auto set_user_data_back = IDASetUserDataB;
  static constexpr auto set_tolerances_back = IDASVtolerancesB;
  static constexpr auto set_max_steps_back = IDASetMaxNumStepsB;
  static constexpr auto set_max_step_back = IDASetMaxStepB;
  static constexpr auto set_linear_solver_back = IDASetLinearSolverB;
  static int init_quadrature_back(void* m, int which, BackwardQuadrature f, N_Vector q) {
    return IDAQuadInitB(m, which, f, q);
  }
  static constexpr auto set_quadrature_tolerances_back = IDAQuadSVtolerancesB;
  static constexpr auto set_quadrature_error_control_back = IDASetQuadErrConB;
  static int solve_back(void* m, double to) { return IDASolveB(m, to, IDA_NORMAL); }
  static constexpr auto state_back = IDAGetAdjY;
  static int get_back(void* m, int which, double* t, N_Vector y, N_Vector yp) { return IDAGetB(m, which, t, y, yp); }
  static int restart_back(void* m, int which, double t, N_Vector y, N_Vector yp) {
    return IDAReInitB(m, which, t, y, yp);
  }
  static constexpr auto restart_quadrature_back = IDAQuadReInitB;
};

}  // namespace costate
