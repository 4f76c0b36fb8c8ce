#include "costate/sundials/newton_operator.h"

#include <cstring>

#include "costate/sundials/handles.h"

namespace costate {

int newton_operator_solve(SUNLinearSolver s, SUNMatrix, N_Vector x, N_Vector b, double) {
  auto* self = static_cast<NewtonOperator*>(s->content);
  return self->guard_.run([&] {
    if (data(x) != data(b)) std::memcpy(data(x), data(b), static_cast<std::size_t>(N_VGetLength(b)) * sizeof(double));
    self->solve_(data(x));
  });
}

namespace {
SUNMatrix_ID matrix_id(SUNMatrix) { return SUNMATRIX_CUSTOM; }
SUNMatrix matrix_clone(SUNMatrix a) {
  SUNMatrix b = SUNMatNewEmpty(a->sunctx);
  if (b) SUNMatCopyOps(a, b);
  return b;
}
void matrix_destroy(SUNMatrix a) { SUNMatFreeEmpty(a); }
int matrix_zero(SUNMatrix) { return 0; }
int matrix_copy(SUNMatrix, SUNMatrix) { return 0; }
SUNLinearSolver_Type solver_type(SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; }
SUNLinearSolver_ID solver_id(SUNLinearSolver) { return SUNLINEARSOLVER_CUSTOM; }
int solver_initialize(SUNLinearSolver) { return 0; }
int solver_setup(SUNLinearSolver, SUNMatrix) { return 0; }
int solver_free(SUNLinearSolver s) {
  SUNLinSolFreeEmpty(s);
  return 0;
}
}  // namespace

NewtonOperator::NewtonOperator(SUNContext context, CallbackGuard& guard, std::function<void(double*)> solve)
    : guard_(guard), solve_(std::move(solve)) {
  matrix_ = SUNMatNewEmpty(context);
  solver_ = SUNLinSolNewEmpty(context);
  if (!matrix_ || !solver_) throw Error("SUNDIALS could not create a linear solver.");
  matrix_->ops->getid = matrix_id;
  matrix_->ops->clone = matrix_clone;
  matrix_->ops->destroy = matrix_destroy;
  matrix_->ops->zero = matrix_zero;
  matrix_->ops->copy = matrix_copy;
  solver_->ops->gettype = solver_type;
  solver_->ops->getid = solver_id;
  solver_->ops->initialize = solver_initialize;
  solver_->ops->setup = solver_setup;
  solver_->ops->solve = newton_operator_solve;
  solver_->ops->free = solver_free;
  solver_->content = this;
}

NewtonOperator::~NewtonOperator() {
  if (solver_) {
    solver_->content = nullptr;
    SUNLinSolFree(solver_);
  }
  if (matrix_) SUNMatDestroy(matrix_);
}

}  // namespace costate
