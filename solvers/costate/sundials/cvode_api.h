// CVODES's side of ida_api.h.
#pragma once

#include <cvodes/cvodes.h>

#include "costate/formulation/system.h"
#include "costate/sundials/message_capture.h"

namespace costate {

struct CvodeApi {
  using SystemType = OdeSystem;
  using CheckpointRecord = CVadjCheckPointRec;
  using Quadrature = CVQuadRhsFn;
  using BackwardQuadrature = CVQuadRhsFnB;
  static constexpr const char* name = "CVODES";
  static constexpr bool implicit = false;

  static constexpr int too_much_work = CV_TOO_MUCH_WORK, no_progress = CV_ERR_FAILURE;
  static bool is_evaluation(int flag) {
    return flag == CV_CONV_FAILURE || flag == CV_REPTD_RHSFUNC_ERR || flag == CV_FIRST_RHSFUNC_ERR;
  }
  static char* flag_name(int flag) { return CVodeGetReturnFlagName(flag); }
  static constexpr auto capture_messages = capture_cvode_messages;

  static void free(void** m) { CVodeFree(m); }
  static constexpr auto set_user_data = CVodeSetUserData;
  static constexpr auto set_max_steps = CVodeSetMaxNumSteps;
  static constexpr auto set_max_error_test_failures = CVodeSetMaxErrTestFails;
  static constexpr auto set_stop_time = CVodeSetStopTime;
  static constexpr auto set_max_step = CVodeSetMaxStep;
  static constexpr auto set_linear_solver = CVodeSetLinearSolver;
  static int init_quadrature(void* m, Quadrature f, N_Vector q) { return CVodeQuadInit(m, f, q); }
  static constexpr auto set_quadrature_tolerances = CVodeQuadSStolerances;
  static constexpr auto set_quadrature_error_control = CVodeSetQuadErrCon;
  static int init_adjoint(void* m, long steps) { return CVodeAdjInit(m, steps, CV_POLYNOMIAL); }

  static int solve(void* m, double to, double* reached, N_Vector y, N_Vector, bool one_step, int* checkpoints) {
    const int mode = one_step ? CV_ONE_STEP : CV_NORMAL;
    return checkpoints ? CVodeF(m, to, y, reached, mode, checkpoints) : CVode(m, to, y, reached, mode);
  }
  static constexpr auto dky = CVodeGetDky;
  static constexpr auto quadrature_dky = CVodeGetQuadDky;
  static constexpr auto sensitivity_dky = CVodeGetSensDky;
  static constexpr auto last_order = CVodeGetLastOrder;
  static constexpr auto last_step = CVodeGetLastStep;
  static constexpr auto current_time = CVodeGetCurrentTime;
  static constexpr auto current_step = CVodeGetCurrentStep;
  static constexpr auto weights = CVodeGetErrWeights;
  static constexpr auto local_errors = CVodeGetEstLocalErrors;
  static constexpr auto steps = CVodeGetNumSteps;
  static constexpr auto evaluations = CVodeGetNumRhsEvals;
  static constexpr auto newton_iterations = CVodeGetNumNonlinSolvIters;
  static constexpr auto error_test_failures = CVodeGetNumErrTestFails;
  static constexpr auto convergence_failures = CVodeGetNumNonlinSolvConvFails;
  static constexpr auto sensitivity_evaluations = CVodeGetSensNumRhsEvals;
  static constexpr auto checkpoints = CVodeGetAdjCheckPointsInfo;

  static constexpr auto backward_memory = CVodeGetAdjCVodeBmem;
  static constexpr auto set_user_data_back = CVodeSetUserDataB;
  static constexpr auto set_tolerances_back = CVodeSVtolerancesB;
  static constexpr auto set_max_steps_back = CVodeSetMaxNumStepsB;
  static constexpr auto set_max_step_back = CVodeSetMaxStepB;
  static constexpr auto set_linear_solver_back = CVodeSetLinearSolverB;
  static int init_quadrature_back(void* m, int which, BackwardQuadrature f, N_Vector q) {
    return CVodeQuadInitB(m, which, f, q);
  }
  static constexpr auto set_quadrature_tolerances_back = CVodeQuadSVtolerancesB;
  static constexpr auto set_quadrature_error_control_back = CVodeSetQuadErrConB;
  static int solve_back(void* m, double to) { return CVodeB(m, to, CV_NORMAL); }
  static int state_back(void* m, double t, N_Vector y, N_Vector) { return CVodeGetAdjY(m, t, y); }
  static int get_back(void* m, int which, double* t, N_Vector y, N_Vector) { return CVodeGetB(m, which, t, y); }
  static int restart_back(void* m, int which, double t, N_Vector y, N_Vector) { return CVodeReInitB(m, which, t, y); }
  static constexpr auto restart_quadrature_back = CVodeQuadReInitB;
};

}  // namespace costate
