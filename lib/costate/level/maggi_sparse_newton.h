// The Newton matrix of Maggi's equations (maggi_newton.h) of many freedoms, without R: as one sparse matrix in the
// changes of all coordinates, velocities, accelerations and multipliers,
//   Phi_q dq = 0,                            B (dq - g dv) = b_y
//   Phi_q dv + Phid_q dq = 0,                B (dv - g da) = b_yd
//   Phi_q da + 2 Phid_q dv + Phidd_q dq = 0, K dq + C dv + M da + Phi_q^T dl - Q_z dz = B^T b_w
//   dz - g (f_q dq + f_v dv + f_z dz) = b_z
#pragma once

#include <memory>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/linear/klu_solver.h"
#include "costate/linear/sparse_pattern.h"

namespace costate {

class MaggiSparseNewton {
 public:
  explicit MaggiSparseNewton(const Assembly& assembly);

  /// At the linearized point, with these independent coordinates; false where it is singular.
  [[nodiscard]] bool factor(const Assembly& assembly, const std::vector<int>& independent, double gamma);
  /// (b_y, b_yd, b_w, b_z) -> (dy, dyd, dz) in place, b_w being left as it is; and the transpose, which gives back the
  /// weights of all four.
  void solve(double* y, double* yd, const double* w, double* z);
  void solve_transposed(double* y, double* yd, double* w, double* z);

 private:
  /// For another choice of independent coordinates.
  void place(const Assembly& assembly, const std::vector<int>& independent);

  int n_, m_, f_ = 0, nz_;
  std::vector<int> independent_;
  struct Blocks {
    int phi_q, y_q, y_v, phi_v, phid_q, yd_v, yd_a, phi_a, phid_v, phidd_q, K, C, M, reaction, Q_z, f_q, f_v, f_z, z;
  } at_{};
  std::unique_ptr<BlockMatrix> matrix_;
  std::unique_ptr<KluSolver> solver_;
  std::vector<double> x_;
};

}  // namespace costate
