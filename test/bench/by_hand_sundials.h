// What the programs by hand on CVODES and IDAS share: SUNDIALS' own dense vectors and matrices, freed at their end.
#pragma once

#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <string>

#include "costate/base/error.h"
#include "costate/sundials/handles.h"  // for the context alone

namespace costate::bench::by_hand {

inline double* numbers(N_Vector v) { return NV_DATA_S(v); }

inline void require(int flag, const char* what) {
  if (flag < 0) throw SolverError(std::string("The five-bar by hand: ") + what + " failed.");
}

struct State {
  N_Vector v;
  State(int size, SUNContext context) : v(N_VNew_Serial(size, context)) { N_VConst(0, v); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { N_VDestroy(v); }
  operator N_Vector() const { return v; }  // NOLINT: a handle
};

struct DenseSolver {
  SUNMatrix matrix;
  SUNLinearSolver solver;
  DenseSolver(int size, N_Vector y, SUNContext context)
      : matrix(SUNDenseMatrix(size, size, context)), solver(SUNLinSol_Dense(y, matrix, context)) {}
  DenseSolver(const DenseSolver&) = delete;
  DenseSolver& operator=(const DenseSolver&) = delete;
  ~DenseSolver() {
    SUNLinSolFree(solver);
    SUNMatDestroy(matrix);
  }
};

}  // namespace costate::bench::by_hand
