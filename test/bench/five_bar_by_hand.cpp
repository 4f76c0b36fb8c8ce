#include "five_bar_by_hand.h"

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "costate/base/error.h"
#include "costate/sundials/handles.h"  // for the context alone: the vectors are SUNDIALS' own

namespace costate::bench {

namespace {

constexpr int kQ = 6, kRows = 4, kState = 2 * kQ, kKkt = kQ + kRows, kParameters = 2;
constexpr int kStoredSteps = 3000;
constexpr double kTEnd = 5, kGravity = 9.81, kStiffness = 100, kDamping = 20, kSpring = 100;  // 2 xi omega, omega^2

template <int Rows, int Columns>
using Table = std::array<std::array<double, Columns>, Rows>;

/// Ends of bar k: the coordinates of a point, or of a ground point (negative).
struct Bar {
  int from, to;  // first coordinate, or -1
  double ground_x, ground_y, mass, length_squared;
};
const std::array<Bar, kRows> kBars = {
    {{-1, 0, 0, 0, 1.0, 1.25}, {0, 2, 0, 0, 1.5, 2.0}, {2, 4, 0, 0, 1.5, 2.0}, {-1, 4, 1, 0, 1.0, 1.25}}};
const std::array<std::array<double, 2>, 2> kAnchors = {{{-0.5, 0}, {1, 0}}};
const std::array<double, 2> kNatural = {std::sqrt(5.0), std::sqrt(4.25)};
const std::array<double, kQ> kStart = {-0.5, 1, 0.5, 2, 1.5, 1};

/// Everything that is evaluated at one (q, v): accelerations, multipliers and, on request, f_y and f_rho.
class FiveBar {
 public:
  FiveBar() {
    for (const Bar& b : kBars) {
      const double third = b.mass / 3, sixth = b.mass / 6;
      for (int d = 0; d < 2; ++d) {
        mass_[b.to + d][b.to + d] += third;
        if (b.from < 0) continue;
        mass_[b.from + d][b.from + d] += third;
        mass_[b.from + d][b.to + d] += sixth;
        mass_[b.to + d][b.from + d] += sixth;
      }
      weight_[b.to + 1] -= b.mass * kGravity / 2;
      if (b.from >= 0) weight_[b.from + 1] -= b.mass * kGravity / 2;
    }
  }

  long evaluations = 0, jacobians = 0;

  void rhs(const double* y, double* f) {
    ++evaluations;
    solve_accelerations(y);
    for (int i = 0; i < kQ; ++i) {
      f[i] = y[kQ + i];
      f[kQ + i] = x_[i];
    }
  }

  /// J = f_y; with_parameters also f_rho in `columns()`.
  const Table<kState, kState>& jacobian(const double* y, bool with_parameters) {
    ++jacobians;
    solve_accelerations(y);
    const double *v = y + kQ, *lambda = x_.data() + kQ;
    // Column j < 6: KKT [a_j; .] = -[K_j; R2_q,j], column 6 + j: -[0; R2_v,j].
    Table<kState, kKkt> c{};
    for (int r = 0; r < kRows; ++r) {
      const Bar& b = kBars[r];
      for (int d = 0; d < 2; ++d) {
        const double u = 2 * (v[b.to + d] - (b.from < 0 ? 0 : v[b.from + d]));
        const double a = 2 * (x_[b.to + d] - (b.from < 0 ? 0 : x_[b.from + d]));
        const double p = phi_q_[r][b.to + d];
        const double R2_q = a + kDamping * u + kSpring * p, R2_v = 2 * u + kDamping * p, h = 2 * lambda[r];
        c[b.to + d][kQ + r] = -R2_q;
        c[kQ + b.to + d][kQ + r] = -R2_v;
        c[b.to + d][b.to + d] -= h;
        if (b.from < 0) continue;
        c[b.from + d][kQ + r] = R2_q;
        c[kQ + b.from + d][kQ + r] = R2_v;
        c[b.from + d][b.from + d] -= h;
        c[b.from + d][b.to + d] += h;
        c[b.to + d][b.from + d] += h;
      }
    }
    for (int s = 0; s < 2; ++s) {
      const double *n = direction_[s].data(), along = kStiffness * (1 - kNatural[s] / length_[s]),
                   across = kStiffness * kNatural[s] / length_[s];
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) c[2 + j][2 + i] -= across * n[i] * n[j] + (i == j ? along : 0);
    }
    for (int j = 0; j < kState; ++j) {
      solve(c[j].data());
      for (int i = 0; i < kQ; ++i) {
        f_y_[j][i] = j == kQ + i ? 1 : 0;
        f_y_[j][kQ + i] = c[j][i];
      }
    }
    if (with_parameters)
      for (int s = 0; s < kParameters; ++s) {
        std::array<double, kKkt> b{};
        b[2] = kStiffness * direction_[s][0];
        b[3] = kStiffness * direction_[s][1];
        solve(b.data());
        std::copy_n(b.begin(), kQ, f_rho_[s].begin());
      }
    return f_y_;
  }
  const Table<kParameters, kQ>& columns() const { return f_rho_; }

 private:
  void solve_accelerations(const double* y) {
    const double *q = y, *v = y + kQ;
    for (int i = 0; i < kQ; ++i)
      for (int j = 0; j < kQ; ++j) lu_[i][j] = mass_[i][j];
    std::copy(weight_.begin(), weight_.end(), x_.begin());
    for (auto& row : phi_q_) row.fill(0);
    for (int r = 0; r < kRows; ++r) {
      const Bar& b = kBars[r];
      double d[2], u[2];
      const double ground[2] = {b.ground_x, b.ground_y};
      for (int i = 0; i < 2; ++i) {
        d[i] = q[b.to + i] - (b.from < 0 ? ground[i] : q[b.from + i]);
        u[i] = v[b.to + i] - (b.from < 0 ? 0 : v[b.from + i]);
        phi_q_[r][b.to + i] = 2 * d[i];
        if (b.from >= 0) phi_q_[r][b.from + i] = -2 * d[i];
      }
      x_[kQ + r] = -2 * (u[0] * u[0] + u[1] * u[1]) - kDamping * 2 * (d[0] * u[0] + d[1] * u[1]) -
                   kSpring * (d[0] * d[0] + d[1] * d[1] - b.length_squared);
      for (int i = 0; i < kQ; ++i) lu_[i][kQ + r] = lu_[kQ + r][i] = phi_q_[r][i];
      for (int i = 0; i < kRows; ++i) lu_[kQ + r][kQ + i] = 0;
    }
    for (int s = 0; s < 2; ++s) {
      const double dx = q[2] - kAnchors[s][0], dy = q[3] - kAnchors[s][1];
      length_[s] = std::sqrt(dx * dx + dy * dy);
      direction_[s] = {dx / length_[s], dy / length_[s]};
      const double force = kStiffness * (length_[s] - kNatural[s]);
      x_[2] -= force * direction_[s][0];
      x_[3] -= force * direction_[s][1];
    }
    factor();
    solve(x_.data());
  }

  /// Dense LU with partial pivoting.
  void factor() {
    for (int k = 0; k < kKkt; ++k) {
      int p = k;
      for (int i = k + 1; i < kKkt; ++i)
        if (std::abs(lu_[i][k]) > std::abs(lu_[p][k])) p = i;
      pivot_[k] = p;
      if (p != k) std::swap(lu_[p], lu_[k]);
      inverse_[k] = 1 / lu_[k][k];
      for (int i = k + 1; i < kKkt; ++i) {
        const double l = lu_[i][k] *= inverse_[k];
        if (l == 0) continue;
        for (int j = k + 1; j < kKkt; ++j) lu_[i][j] -= l * lu_[k][j];
      }
    }
  }
  void solve(double* b) const {
    for (int k = 0; k < kKkt; ++k)
      if (pivot_[k] != k) std::swap(b[k], b[pivot_[k]]);
    for (int i = 1; i < kKkt; ++i)
      for (int k = 0; k < i; ++k) b[i] -= lu_[i][k] * b[k];
    for (int i = kKkt - 1; i >= 0; --i) {
      for (int k = i + 1; k < kKkt; ++k) b[i] -= lu_[i][k] * b[k];
      b[i] *= inverse_[i];
    }
  }

  Table<kQ, kQ> mass_{};
  std::array<double, kQ> weight_{};
  Table<kRows, kQ> phi_q_{};
  Table<kKkt, kKkt> lu_{};
  std::array<int, kKkt> pivot_{};
  std::array<double, kKkt> inverse_{}, x_{};  // x = (a, lambda)
  std::array<double, 2> length_{};
  std::array<std::array<double, 2>, 2> direction_{};
  Table<kState, kState> f_y_{};     // by columns
  Table<kParameters, kQ> f_rho_{};  // by columns, the velocity rows
};

double* numbers(N_Vector v) { return NV_DATA_S(v); }
FiveBar& model(void* p) { return *static_cast<FiveBar*>(p); }

int rhs(double, N_Vector y, N_Vector f, void* p) {
  model(p).rhs(numbers(y), numbers(f));
  return 0;
}
int jacobian(double, N_Vector y, N_Vector, SUNMatrix J, void* p, N_Vector, N_Vector, N_Vector) {
  const auto& f_y = model(p).jacobian(numbers(y), false);
  for (int j = 0; j < kState; ++j) std::copy(f_y[j].begin(), f_y[j].end(), SM_COLUMN_D(J, j));
  return 0;
}
int cost(double, N_Vector y, N_Vector q, void*) {
  const double dx = numbers(y)[2] - kStart[2], dy = numbers(y)[3] - kStart[3];
  numbers(q)[0] = dx * dx + dy * dy;
  return 0;
}
int backward_rhs(double, N_Vector y, N_Vector mu, N_Vector f, void* p) {
  const auto& f_y = model(p).jacobian(numbers(y), false);
  for (int j = 0; j < kState; ++j) {
    double sum = 0;
    for (int i = 0; i < kState; ++i) sum += f_y[j][i] * numbers(mu)[i];
    numbers(f)[j] = -sum;
  }
  for (int i = 2; i < 4; ++i) numbers(f)[i] -= 2 * (numbers(y)[i] - kStart[i]);
  return 0;
}
int backward_jacobian(double, N_Vector y, N_Vector, N_Vector, SUNMatrix J, void* p, N_Vector, N_Vector, N_Vector) {
  const auto& f_y = model(p).jacobian(numbers(y), false);
  for (int j = 0; j < kState; ++j)
    for (int i = 0; i < kState; ++i) SM_ELEMENT_D(J, j, i) = -f_y[j][i];
  return 0;
}
int backward_quadrature(double, N_Vector y, N_Vector mu, N_Vector q, void* p) {
  model(p).jacobian(numbers(y), true);
  for (int s = 0; s < kParameters; ++s) {
    double sum = 0;
    for (int i = 0; i < kQ; ++i) sum += model(p).columns()[s][i] * numbers(mu)[kQ + i];
    numbers(q)[s] = -sum;
  }
  return 0;
}

void require(int flag, const char* what) {
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
  DenseSolver(N_Vector y, SUNContext context)
      : matrix(SUNDenseMatrix(kState, kState, context)), solver(SUNLinSol_Dense(y, matrix, context)) {}
  DenseSolver(const DenseSolver&) = delete;
  DenseSolver& operator=(const DenseSolver&) = delete;
  ~DenseSolver() {
    SUNLinSolFree(solver);
    SUNMatDestroy(matrix);
  }
};

struct Memory {
  void* cvode;
  Memory(int method, SUNContext context) : cvode(CVodeCreate(method, context)) {}
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  ~Memory() { CVodeFree(&cvode); }
};

ByHandResult run(double rtol, Multistep multistep, bool with_gradient) {
  const int method = multistep == Multistep::adams ? CV_ADAMS : CV_BDF;
  FiveBar five_bar;
  ByHandResult result;
  const Context context;
  const State y(kState, context), q(1, context), mu(kState, context), gradient(kParameters, context);
  const DenseSolver linear(y, context), backward_linear(mu, context);
  const Memory memory(method, context);
  void* m = memory.cvode;
  std::copy(kStart.begin(), kStart.end(), numbers(y));
  require(CVodeInit(m, rhs, 0, y), "CVodeInit");
  require(CVodeSetUserData(m, &five_bar), "CVodeSetUserData");
  require(CVodeSStolerances(m, rtol, rtol), "CVodeSStolerances");
  require(CVodeSetMaxNumSteps(m, 1'000'000), "CVodeSetMaxNumSteps");
  require(CVodeSetLinearSolver(m, linear.solver, linear.matrix), "CVodeSetLinearSolver");
  require(CVodeSetJacFn(m, jacobian), "CVodeSetJacFn");
  require(CVodeQuadInit(m, cost, q), "CVodeQuadInit");
  require(CVodeQuadSStolerances(m, rtol, rtol), "CVodeQuadSStolerances");
  require(CVodeSetQuadErrCon(m, SUNTRUE), "CVodeSetQuadErrCon");
  double t = 0;
  if (with_gradient) {
    int checkpoints = 0;
    require(CVodeAdjInit(m, kStoredSteps, CV_POLYNOMIAL), "CVodeAdjInit");
    require(CVodeF(m, kTEnd, y, &t, CV_NORMAL, &checkpoints), "CVodeF");
  } else {
    require(CVode(m, kTEnd, y, &t, CV_NORMAL), "CVode");
  }
  require(CVodeGetQuad(m, &t, q), "CVodeGetQuad");
  result.psi = numbers(q)[0];
  CVodeGetNumSteps(m, &result.steps);
  if (with_gradient) {
    int which = 0;
    require(CVodeCreateB(m, method, &which), "CVodeCreateB");
    require(CVodeInitB(m, which, backward_rhs, kTEnd, mu), "CVodeInitB");
    require(CVodeSetUserDataB(m, which, &five_bar), "CVodeSetUserDataB");
    require(CVodeSStolerancesB(m, which, rtol, rtol), "CVodeSStolerancesB");
    require(CVodeSetMaxNumStepsB(m, which, 1'000'000), "CVodeSetMaxNumStepsB");
    require(CVodeSetLinearSolverB(m, which, backward_linear.solver, backward_linear.matrix), "CVodeSetLinearSolverB");
    require(CVodeSetJacFnB(m, which, backward_jacobian), "CVodeSetJacFnB");
    require(CVodeQuadInitB(m, which, backward_quadrature, gradient), "CVodeQuadInitB");
    require(CVodeQuadSStolerancesB(m, which, rtol, rtol), "CVodeQuadSStolerancesB");
    require(CVodeSetQuadErrConB(m, which, SUNTRUE), "CVodeSetQuadErrConB");
    require(CVodeB(m, 0, CV_NORMAL), "CVodeB");
    require(CVodeGetQuadB(m, which, &t, gradient), "CVodeGetQuadB");
    CVodeGetNumSteps(CVodeGetAdjCVodeBmem(m, which), &result.backward_steps);
    result.gradient.assign(numbers(gradient), numbers(gradient) + kParameters);
  }
  result.evaluations = five_bar.evaluations;
  result.jacobians = five_bar.jacobians;
  return result;
}

}  // namespace

ByHandResult simulate_by_hand(double rtol, Multistep method) { return run(rtol, method, false); }
ByHandResult gradient_by_hand(double rtol, Multistep method) { return run(rtol, method, true); }

}  // namespace costate::bench
