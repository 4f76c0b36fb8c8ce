#include "costate/sundials/judged_newton.h"

#include <algorithm>
#include <cmath>

namespace costate {

namespace {
// What an iteration leaves of an error, r/(1 - r) with its rate r: behind new factors, and at least.
constexpr double kUnknown = 20, kLeast = 0.05;
constexpr double kDone = 1e-4, kDiverges = 0.9;
// Of the tolerance: what is in the norm rests, but for rounding.
constexpr double kRests = 1e-8;
}  // namespace

JudgedNewton::JudgedNewton(N_Vector y, int columns, SUNContext context, const long& setups, bool some_outside)
    : solver_(columns > 0 ? SUNNonlinSol_NewtonSens(columns, y, context) : SUNNonlinSol_Newton(y, context)),
      setups_(setups),
      some_outside_(some_outside) {}

int JudgedNewton::ends(SUNNonlinearSolver newton, N_Vector, N_Vector step, double tolerance, N_Vector weights,
                       void* p) {
  JudgedNewton& s = *static_cast<JudgedNewton*>(p);
  const double length = N_VWrmsNorm(step, weights);
  int k = 0;
  SUNNonlinSolGetCurIter(newton, &k);
  if (s.known_ != s.setups_) {
    s.known_ = s.setups_;
    s.leaves_ = kUnknown;
    s.fresh_ = true;
  } else if (k == 0) {
    s.fresh_ = false;
  }
  const bool nothing = length <= kDone * tolerance;
  if (k == 0) {
    s.first_ = length;
    // Older factors may lack just what has begun to act, so that what is in the norm does not see it at all: an adjoint
    // of index 2 that has been zero while a driven mechanism stood still. Another iteration tells.
    if (nothing)
      return !s.some_outside_ || length > kRests * tolerance || s.fresh_ ? SUN_NLS_SUCCESS : SUN_NLS_CONTINUE;
  } else if (s.some_outside_ && !(s.first_ > kRests * tolerance)) {
    return nothing ? SUN_NLS_SUCCESS : SUN_NLS_CONV_RECVR;  // with factors of this step
  } else {
    const double rate = std::pow(length / s.first_, 1.0 / k);
    if (rate > kDiverges) return SUN_NLS_CONV_RECVR;
    s.leaves_ = rate / (1 - rate);
  }
  const double leaves = k == 0 ? std::max(s.leaves_, kLeast) : s.leaves_;
  return leaves * length <= tolerance ? SUN_NLS_SUCCESS : SUN_NLS_CONTINUE;
}

}  // namespace costate
