/* The forms of M a = f - G^T lambda, g(t, q) = 0 that solvers are given. Before this is included, a problem defines
   COORDINATES, CONSTRAINTS and ACCELERATIONS (1: accelerations are unknowns, as in the test set's Andrews; 0: they
   follow from a constant diagonal M), and behind it the functions below. Unknowns: q, v, (a,) lambda; in the explicit
   form q, v. */
#include <math.h>
#include <string.h>
#include <time.h>

static void masses(const double* q, double M[COORDINATES][COORDINATES]);
static void forces(double t, const double* q, const double* v, double* f);
static void constraint(double t, const double* q, double* g);
/* dg/dq */
static void rows(double t, const double* q, double G[CONSTRAINTS][COORDINATES]);
/* dg/dt, so that g' = G v + dg/dt */
static void drift(double t, const double* q, double* g_t);
/* What G a lacks for g''. */
static void curvature(double t, const double* q, const double* v, double* c);
/* Positions of the start (those that are not given: near it) and velocities. */
static void first_guess(double* q, double* v);

enum {
  kQ = COORDINATES,
  kC = CONSTRAINTS,
  kA = ACCELERATIONS ? COORDINATES : 0,
  kLambda = 2 * kQ + kA,
  kUnknowns = kLambda + kC,
  kSystem = kQ + kC
};

static long evaluations;

/* A x = b by Gauss with row pivots; x in b's place. Returns 0 where A is singular. */
static int solve(int n, double A[kSystem][kSystem], double* b) {
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i)
      if (fabs(A[i][k]) > fabs(A[pivot][k])) pivot = i;
    if (A[pivot][k] == 0) return 0;
    if (pivot != k) {
      for (int j = k; j < n; ++j) {
        const double swap = A[k][j];
        A[k][j] = A[pivot][j];
        A[pivot][j] = swap;
      }
      const double swap = b[k];
      b[k] = b[pivot];
      b[pivot] = swap;
    }
    for (int i = k + 1; i < n; ++i) {
      const double factor = A[i][k] / A[k][k];
      if (factor == 0) continue;
      for (int j = k + 1; j < n; ++j) A[i][j] -= factor * A[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (int k = n - 1; k >= 0; --k) {
    for (int j = k + 1; j < n; ++j) b[k] -= A[k][j] * b[j];
    b[k] /= A[k][k];
  }
  return 1;
}

/* x = (a, lambda) from M a + G^T lambda = f, G a = -c. */
static void accelerate(double t, const double* q, const double* v, double* x) {
  double A[kSystem][kSystem], M[kQ][kQ], G[kC][kQ];
  memset(A, 0, sizeof A);
  masses(q, M);
  rows(t, q, G);
  for (int i = 0; i < kQ; ++i)
    for (int j = 0; j < kQ; ++j) A[i][j] = M[i][j];
  for (int i = 0; i < kC; ++i)
    for (int j = 0; j < kQ; ++j) A[kQ + i][j] = A[j][kQ + i] = G[i][j];
  forces(t, q, v, x);
  curvature(t, q, v, x + kQ);
  for (int i = kQ; i < kSystem; ++i) x[i] = -x[i];
  if (!solve(kSystem, A, x))
    for (int i = 0; i < kSystem; ++i) x[i] = NAN;
}

/* Derivatives of q and v, and what has to vanish: the equations of motion where accelerations are unknowns, then the
   constraint at the level that makes the whole of this index. */
static void implicit_form(int index, double t, const double* y, double* out) {
  const double *q = y, *v = y + kQ, *lambda = y + kLambda;
  double G[kC][kQ], M[kQ][kQ], balance[kQ];
  const double* a = ACCELERATIONS ? y + 2 * kQ : balance;
  ++evaluations;
  masses(q, M);
  rows(t, q, G);
  forces(t, q, v, balance);
  for (int i = 0; i < kC; ++i)
    for (int j = 0; j < kQ; ++j) balance[j] -= G[i][j] * lambda[i];
  if (ACCELERATIONS) {
    for (int i = 0; i < kQ; ++i) {
      for (int j = 0; j < kQ; ++j) balance[i] -= M[i][j] * a[j];
      out[2 * kQ + i] = balance[i];
    }
  } else {
    for (int i = 0; i < kQ; ++i) balance[i] /= M[i][i];
  }
  for (int i = 0; i < kQ; ++i) {
    out[i] = v[i];
    out[kQ + i] = a[i];
  }
  double* g = out + kLambda;
  if (index == 3) {
    constraint(t, q, g);
  } else {
    if (index == 2)
      drift(t, q, g);
    else
      curvature(t, q, v, g);
    for (int i = 0; i < kC; ++i)
      for (int j = 0; j < kQ; ++j) g[i] += G[i][j] * (index == 2 ? v[j] : a[j]);
  }
}

static void residual_form(int index, double t, const double* y, const double* rates, double* residual) {
  implicit_form(index, t, y, residual);
  for (int i = 0; i < 2 * kQ; ++i) residual[i] = rates[i] - residual[i];
}

/* What deSolve calls. */
#define IMPLICIT(name, index) \
  void name(int* n, double* t, double* y, double* out, double* extra, int* ip) { implicit_form(index, *t, y, out); }
#define RESIDUAL(name, index)                                                                                         \
  void name(double* t, double* y, double* rates, double* cj, double* residual, int* status, double* extra, int* ip) { \
    residual_form(index, *t, y, rates, residual);                                                                     \
  }
IMPLICIT(index1, 1)
IMPLICIT(index2, 2)
IMPLICIT(index3, 3)
RESIDUAL(residual1, 1)
RESIDUAL(residual2, 2)
RESIDUAL(residual3, 3)

void explicit_form(int* n, double* t, double* y, double* out, double* extra, int* ip) {
  double x[kSystem];
  ++evaluations;
  accelerate(*t, y, y + kQ, x);
  for (int i = 0; i < kQ; ++i) {
    out[i] = y[kQ + i];
    out[kQ + i] = x[i];
  }
}

/* Sizes: coordinates, accelerations that are unknowns, multipliers. */
void sizes(int* out) {
  out[0] = kQ;
  out[1] = kA;
  out[2] = kC;
}

/* A consistent start: Newton's steps of least length on g = 0, positions before `free_from` kept; then accelerations
   and multipliers. `off`: how far the constraint and its rate are from zero at the end. */
static void consistent_start(double* y, int free_from, double* off) {
  double *q = y, *v = y + kQ, g[kC], g_t[kC], G[kC][kQ], A[kSystem][kSystem], x[kSystem];
  memset(y, 0, kUnknowns * sizeof *y);
  first_guess(q, v);
  for (int step = 0; step < 20; ++step) {
    constraint(0, q, g);
    rows(0, q, G);
    for (int i = 0; i < kC; ++i) {
      x[i] = -g[i];
      for (int j = 0; j < kC; ++j) {
        A[i][j] = 0;
        for (int k = free_from; k < kQ; ++k) A[i][j] += G[i][k] * G[j][k];
      }
    }
    if (!solve(kC, A, x)) break;
    for (int k = free_from; k < kQ; ++k)
      for (int i = 0; i < kC; ++i) q[k] += G[i][k] * x[i];
  }
  constraint(0, q, g);
  rows(0, q, G);
  drift(0, q, g_t);
  *off = 0;
  for (int i = 0; i < kC; ++i) {
    for (int j = 0; j < kQ; ++j) g_t[i] += G[i][j] * v[j];
    *off = fmax(*off, fmax(fabs(g[i]), fabs(g_t[i])));
  }
  accelerate(0, q, v, x);
  memcpy(y + 2 * kQ, x, kA * sizeof *x);
  memcpy(y + kLambda, x + kQ, kC * sizeof *x);
}

void evaluations_since(double* out) {
  *out = evaluations;
  evaluations = 0;
}

/* The processor's time. */
void seconds_now(double* out) {
  struct timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  *out = now.tv_sec + 1e-9 * now.tv_nsec;
}
