// Dense factorizations in place and without allocation, for the small full matrices of reduced formulations.
// Matrices are column after column, n x n.
#pragma once

namespace costate {

/// A = L L^T in the lower triangle (the upper one is left alone). Returns -1, or the column whose pivot is not positive
/// or lost 14 digits against the diagonal.
[[nodiscard]] int factor_cholesky(double* A, int n);
void solve_cholesky(const double* L, int n, double* b);

/// P A = L U with row exchanges; `pivots` has n entries. Returns -1, or the column without a pivot.
[[nodiscard]] int factor_lu(double* A, int n, int* pivots);
void solve_lu(const double* LU, int n, const int* pivots, double* b);
void solve_lu_transposed(const double* LU, int n, const int* pivots, double* b);

}  // namespace costate
