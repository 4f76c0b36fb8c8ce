// Newton's method for IDAS, with a convergence test that knows what a first iteration is worth. IDAS judges it by the
// rate of an earlier step, next to nothing where the factors were new then, and takes a step on one iteration while a
// body turns on: constraints of index 2 came off by twenty tolerances within five steps, and over stiff springs what
// iterations left failed one error test after another.
#pragma once

#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <memory>

namespace costate {

class JudgedNewton {
 public:
  /// For vectors like y, or for so many columns of sensitivities; `setups` counts the factorizations. Whether there are
  /// unknowns that no norm holds (those of index 2), which a first iteration says nothing of: `some_outside`.
  JudgedNewton(N_Vector y, int columns, SUNContext context, const long& setups, bool some_outside);

  /// Gives it to IDAS by a call of set(SUNNonlinearSolver), whose flag is returned.
  template <class Set>
  int attach(Set&& set) {
    const int flag = set(solver_.get());
    // IDAS has set its own.
    if (flag >= 0) SUNNonlinSolSetConvTestFn(solver_.get(), ends, this);
    return flag;
  }

 private:
  /// Whether an iteration was the last one.
  static int ends(SUNNonlinearSolver newton, N_Vector y, N_Vector step, double tolerance, N_Vector weights, void* self);

  struct Free {
    void operator()(SUNNonlinearSolver newton) const { SUNNonlinSolFree(newton); }
  };
  std::unique_ptr<_generic_SUNNonlinearSolver, Free> solver_;
  const long& setups_;
  long known_ = -1;  // setups when the rate was known
  bool some_outside_;
  bool fresh_ = false;  // the factors are of this step
  double first_ = 0, leaves_ = 0;
};

}  // namespace costate
