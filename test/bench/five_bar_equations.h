// The equations of the five-bar of five_bar.h by hand, for the programs that are compared with the library: dense, in
// points' coordinates, for this one mechanism.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace costate::bench::by_hand {

inline constexpr int kQ = 6, kRows = 4, kState = 2 * kQ, kKkt = kQ + kRows, kParameters = 2;
inline constexpr double kTEnd = 5, kGravity = 9.81, kStiffness = 100, kDamping = 20,
                        kSpring = 100;  // 2 xi omega, omega^2

template <int Rows, int Columns>
using Table = std::array<std::array<double, Columns>, Rows>;

/// Ends of bar k: the coordinates of a point, or of a ground point (negative).
struct Bar {
  int from, to;  // first coordinate, or -1
  double ground_x, ground_y, mass, length_squared;
};
inline const std::array<Bar, kRows> kBars = {
    {{-1, 0, 0, 0, 1.0, 1.25}, {0, 2, 0, 0, 1.5, 2.0}, {2, 4, 0, 0, 1.5, 2.0}, {-1, 4, 1, 0, 1.0, 1.25}}};
inline const std::array<std::array<double, 2>, 2> kAnchors = {{{-0.5, 0}, {1, 0}}};
inline const std::array<double, 2> kNatural = {std::sqrt(5.0), std::sqrt(4.25)};
inline const std::array<double, kQ> kStart = {-0.5, 1, 0.5, 2, 1.5, 1};

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
    Derivatives c{};
    derivatives(y, x_.data(), c);
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

  /// By columns: -d/d(q, v) of the ten rows of `rows`.
  using Derivatives = Table<kState, kKkt>;

  /// r = [M a + Phi_q^T lambda - Q; Phi_q a - gamma] with x = (a, lambda).
  void rows(const double* y, const double* x, double* r) {
    ++evaluations;
    assemble(y);
    for (int i = 0; i < kKkt; ++i) r[i] = -x_[i];
    for (int i = 0; i < kQ; ++i)
      for (int j = 0; j < kQ; ++j) r[i] += mass_[i][j] * x[j];
    for (int k = 0; k < kRows; ++k)
      for (int i = 0; i < kQ; ++i) {
        r[i] += phi_q_[k][i] * x[kQ + k];
        r[kQ + k] += phi_q_[k][i] * x[i];
      }
  }
  /// What `rows` changes by with q and v, into c, after which mass() and phi_q() are those of this y.
  void rows_derivatives(const double* y, const double* x, Derivatives& c) {
    ++jacobians;
    assemble(y);
    derivatives(y, x, c);
  }
  const Table<kQ, kQ>& mass() const { return mass_; }
  const Table<kRows, kQ>& phi_q() const { return phi_q_; }
  /// dQ/drho of natural length s, at point 2.
  static std::array<double, 2> force_by_length(const double* y, int s) {
    const double dx = y[2] - kAnchors[s][0], dy = y[3] - kAnchors[s][1], k = kStiffness / std::sqrt(dx * dx + dy * dy);
    return {k * dx, k * dy};
  }
  const std::array<double, kKkt>& accelerations(const double* y) {
    solve_accelerations(y);
    return x_;
  }

 private:
  // Column j < 6: KKT [a_j; .] = -[K_j; R2_q,j], column 6 + j: -[0; R2_v,j].
  void derivatives(const double* y, const double* x, Derivatives& c) const {
    const double *v = y + kQ, *lambda = x + kQ;
    for (int r = 0; r < kRows; ++r) {
      const Bar& b = kBars[r];
      for (int d = 0; d < 2; ++d) {
        const double u = 2 * (v[b.to + d] - (b.from < 0 ? 0 : v[b.from + d]));
        const double a = 2 * (x[b.to + d] - (b.from < 0 ? 0 : x[b.from + d]));
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
  }

  /// Phi_q, the springs, and in x_ the right-hand side (Q, gamma).
  void assemble(const double* y) {
    const double *q = y, *v = y + kQ;
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
    }
    for (int s = 0; s < 2; ++s) {
      const double dx = q[2] - kAnchors[s][0], dy = q[3] - kAnchors[s][1];
      length_[s] = std::sqrt(dx * dx + dy * dy);
      direction_[s] = {dx / length_[s], dy / length_[s]};
      const double force = kStiffness * (length_[s] - kNatural[s]);
      x_[2] -= force * direction_[s][0];
      x_[3] -= force * direction_[s][1];
    }
  }
  void solve_accelerations(const double* y) {
    assemble(y);
    for (int i = 0; i < kQ; ++i)
      for (int j = 0; j < kQ; ++j) lu_[i][j] = mass_[i][j];
    for (int r = 0; r < kRows; ++r) {
      for (int i = 0; i < kQ; ++i) lu_[i][kQ + r] = lu_[kQ + r][i] = phi_q_[r][i];
      for (int i = 0; i < kRows; ++i) lu_[kQ + r][kQ + i] = 0;
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

}  // namespace costate::bench::by_hand
