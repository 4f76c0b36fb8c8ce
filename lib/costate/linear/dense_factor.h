// Dense factorizations in place and without allocation, for the small full matrices of reduced formulations.
// Matrices are column after column, n x n.
#pragma once

namespace costate {

/// A = L L^T in the lower triangle (the upper one is left alone). Returns -1, or the column whose pivot is not positive
/// or lost 14 digits against the diagonal.
[[nodiscard]] int factor_cholesky(double* A, int n);
void solve_cholesky(const double* L, int n, double* b);

/// P A = L U of the first n of `columns` columns of n entries, with row exchanges in all of them, so that the others
/// become L^-1 P times themselves. `pivots` has n entries, the exchanges in their order; the diagonal of U is kept as
/// reciprocals. Returns -1, or the column whose pivot is not above `least`.
[[nodiscard]] int factor_lu(double* A, int n, int columns, int* pivots, double least);
[[nodiscard]] inline int factor_lu(double* A, int n, int* pivots) { return factor_lu(A, n, n, pivots, 0); }
void solve_lu(const double* LU, int n, const int* pivots, double* b);
void solve_lu_transposed(const double* LU, int n, const int* pivots, double* b);

// Their parts, in place: P b and P^T b, L^-1 b, U^-1 b, and those of the transposes.
void exchange(const int* pivots, int n, double* b);
void exchange_back(const int* pivots, int n, double* b);
void solve_lower(const double* LU, int n, double* b);
void solve_upper(const double* LU, int n, double* b);
void solve_lower_transposed(const double* LU, int n, double* b);
void solve_upper_transposed(const double* LU, int n, double* b);

}  // namespace costate
