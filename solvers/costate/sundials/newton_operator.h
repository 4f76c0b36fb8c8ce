// A SUNDIALS matrix and linear solver that hand the Newton system over to us: the Jacobian callback factors, the
// solve callback solves. A formulation may thus eliminate unknowns, and an adjoint re-uses the forward pattern by a
// transposed solve. The SUNMatrix is a shell without entries.
#pragma once

#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>

#include <functional>

#include "costate/sundials/callback_guard.h"
#include "costate/sundials/compatibility.h"

namespace costate {

class NewtonOperator {
 public:
  /// solve(b) overwrites b with the solution of the system that was factored last.
  NewtonOperator(SUNContext context, CallbackGuard& guard, std::function<void(double*)> solve);
  ~NewtonOperator();
  NewtonOperator(const NewtonOperator&) = delete;
  NewtonOperator& operator=(const NewtonOperator&) = delete;

  SUNMatrix matrix() const { return matrix_; }
  SUNLinearSolver solver() const { return solver_; }

 private:
  friend int newton_operator_solve(SUNLinearSolver, SUNMatrix, N_Vector, N_Vector, double);
  CallbackGuard& guard_;
  std::function<void(double*)> solve_;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver solver_ = nullptr;
};

}  // namespace costate
