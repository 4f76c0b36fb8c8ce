#include "costate/linear/dense_factor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "costate/linear/short_vectors.h"

namespace costate {

namespace {
constexpr double kLost = 1e-14;

const double* column(const double* A, int n, int j) { return A + static_cast<std::ptrdiff_t>(j) * n; }
double* column(double* A, int n, int j) { return A + static_cast<std::ptrdiff_t>(j) * n; }
}  // namespace

int factor_cholesky(double* A, int n) {
  for (int j = 0; j < n; ++j) {
    double* a = column(A, n, j);
    const double diagonal = a[j];
    for (int k = 0; k < j; ++k) {
      const double* l = column(A, n, k);
      const double x = l[j];
      if (x == 0) continue;
      for (int i = j; i < n; ++i) a[i] -= x * l[i];
    }
    if (!(a[j] > kLost * diagonal) || !std::isfinite(a[j])) return j;
    const double root = std::sqrt(a[j]);
    for (int i = j; i < n; ++i) a[i] /= root;
  }
  return -1;
}

void solve_cholesky(const double* L, int n, double* b) {
  for (int j = 0; j < n; ++j) {
    const double* l = column(L, n, j);
    const double x = b[j] /= l[j];
    for (int i = j + 1; i < n; ++i) b[i] -= x * l[i];
  }
  for (int j = n - 1; j >= 0; --j) {
    const double* l = column(L, n, j);
    double x = b[j];
    for (int i = j + 1; i < n; ++i) x -= l[i] * b[i];
    b[j] = x / l[j];
  }
}

int factor_lu(double* A, int n, int columns, int* pivots, double least) {
  for (int k = 0; k < n; ++k) {
    double* a = column(A, n, k);
    int p = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(a[i]) > std::abs(a[p])) p = i;
    pivots[k] = p;
    if (!(std::abs(a[p]) > least) || !std::isfinite(a[p])) return k;
    if (p != k)
      for (int j = 0; j < columns; ++j) std::swap(column(A, n, j)[k], column(A, n, j)[p]);
    a[k] = 1 / a[k];
    for (int i = k + 1; i < n; ++i) a[i] *= a[k];
    for (int j = k + 1; j < columns; ++j) {
      double* c = column(A, n, j);
      if (c[k] != 0) subtract(c[k], a + k + 1, n - k - 1, c + k + 1);
    }
  }
  return -1;
}

void solve_lu(const double* LU, int n, const int* pivots, double* b) {
  exchange(pivots, n, b);
  solve_lower(LU, n, b);
  solve_upper(LU, n, b);
}

void solve_lu_transposed(const double* LU, int n, const int* pivots, double* b) {
  solve_upper_transposed(LU, n, b);
  solve_lower_transposed(LU, n, b);
  exchange_back(pivots, n, b);
}

void exchange(const int* pivots, int n, double* b) {
  for (int k = 0; k < n; ++k) std::swap(b[k], b[pivots[k]]);
}
void exchange_back(const int* pivots, int n, double* b) {
  for (int k = n - 1; k >= 0; --k) std::swap(b[k], b[pivots[k]]);
}

void solve_lower(const double* LU, int n, double* b) {
  for (int k = 0; k < n - 1; ++k)
    if (b[k] != 0) subtract(b[k], column(LU, n, k) + k + 1, n - k - 1, b + k + 1);
}
void solve_upper(const double* LU, int n, double* b) {
  for (int k = n - 1; k >= 0; --k) {
    const double* u = column(LU, n, k);
    b[k] *= u[k];
    subtract(b[k], u, k, b);
  }
}
void solve_lower_transposed(const double* LU, int n, double* b) {
  for (int k = n - 1; k >= 0; --k) b[k] -= dot(column(LU, n, k) + k + 1, b + k + 1, n - k - 1);
}
void solve_upper_transposed(const double* LU, int n, double* b) {
  for (int k = 0; k < n; ++k) b[k] = (b[k] - dot(column(LU, n, k), b, k)) * column(LU, n, k)[k];
}

}  // namespace costate
