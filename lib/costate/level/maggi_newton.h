// Newton matrices of Maggi's equations for a step gamma, reduced to the unknowns (dyd, dz):
//   A = [[My + gamma Cy + gamma^2 Ky, -gamma R^T Q_z], [-gamma (f_v R + gamma Zq), 1 - gamma f_z]],
//   Cy = R^T (C R + 2 M D), Ky = R^T (K R + C D + M A), Zq = f_q R + f_v D,
//   D = -S Phid_q R, A = -S (Phidd_q R + 2 Phid_q D)                                     (lib/README.md (5))
// with R_r^T for R^T where contacts slide, and in the columns of places (maggi_rows.h) dq/dy = S e of their rows for R.
// Full matrices of f + nz unknowns; 2 f sparse solves and products of n f^2 to form them. Of many freedoms one sparse
// matrix in their place (maggi_sparse_newton.h). Serves CVODE (gamma) and IDA (gamma = 1/cj).
#pragma once

#include <memory>
#include <vector>

#include "costate/level/maggi_level.h"
#include "costate/level/maggi_sparse_newton.h"

namespace costate {

class MaggiNewton {
 public:
  explicit MaggiNewton(MaggiLevel& level);

  /// At the linearized point; keeps what solves need, so that the level may move on. Throws SolverError.
  void factor(double gamma);
  double gamma() const { return gamma_; }
  int size() const { return f_ + nz_; }

  /// In place (b_y, b_yd, b_w, b_z) -> (dy, dyd, dz), b_w being left as it is, or null for zero:
  ///   dy = b_y + gamma dyd,  A (dyd, dz) = (My b_yd + gamma (b_w - Ky b_y), b_z + gamma Zq b_y)
  void solve(double* y, double* yd, const double* w, double* z);
  /// The transpose: weights of (dy, dyd, dz) -> those of (b_y, b_yd, b_w, b_z); w may be null.
  void solve_transposed(double* y, double* yd, double* w, double* z);

  // The blocks by value (columns one after the other), for Jacobians: f x f, f x nz, nz x f, nz x nz.
  void form();
  const std::vector<double>& My() const { return My_; }
  const std::vector<double>& Cy() const { return Cy_; }
  const std::vector<double>& Ky() const { return Ky_; }
  const std::vector<double>& force_state() const { return RQ_; }
  const std::vector<double>& Zq() const { return Zq_; }
  const std::vector<double>& Zv() const { return Zv_; }
  const std::vector<double>& f_z() const { return fz_; }

 private:
  /// place_ = S e, how coordinates follow the place of this row.
  void calc_place_column(int row);
  void add(const std::vector<double>& A, int rows, double c, const double* x, double* out) const;
  void add_transposed(const std::vector<double>& A, int rows, double c, const double* x, double* out) const;

  MaggiLevel& level_;
  int n_, m_, f_, nz_;
  double gamma_ = 0;
  bool symmetric_ = true;                      // My
  std::unique_ptr<MaggiSparseNewton> sparse_;  // or null
  std::vector<double> My_, Cy_, Ky_, RQ_, Zq_, Zv_, fz_;
  std::vector<double> D_, A_, column_, lu_, reduced_, place_;
  std::vector<int> pivots_;
};

}  // namespace costate
