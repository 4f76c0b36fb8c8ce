// Newton matrices of Maggi's equations for a step gamma, reduced to the unknowns (dyd, dz):
//   A = [[My + gamma Cy + gamma^2 Ky, -gamma R^T Q_z], [-gamma (f_v R + gamma Zq), 1 - gamma f_z]],
//   Cy = R^T (C R + 2 M D), Ky = R^T (K R + C D + M A), Zq = f_q R + f_v D,
//   D = -S Phid_q R, A = -S (Phidd_q R + 2 Phid_q D)                                     (lib/README.md (5))
// Full matrices of f + nz unknowns; 2 f sparse solves and products of n f^2 to form them. Serves CVODE (gamma) and IDA
// (gamma = 1/cj).
#pragma once

#include <vector>

#include "costate/level/maggi_level.h"

namespace costate {

class MaggiNewton {
 public:
  explicit MaggiNewton(MaggiLevel& level);

  /// At the linearized point; keeps what solves need, so that the level may move on. Throws SolverError.
  void factor(double gamma);
  double gamma() const { return gamma_; }
  void solve(double* u) const;
  void solve_transposed(double* u) const;
  int size() const { return f_ + nz_; }

  // out += c times a block of the last factor().
  void add_mass(double c, const double* x, double* out) const { add(My_, f_, c, x, out); }
  void add_stiffness(double c, const double* x, double* out) const { add(Ky_, f_, c, x, out); }
  void add_rate(double c, const double* x, double* out) const { add(Zq_, nz_, c, x, out); }
  void add_stiffness_transposed(double c, const double* x, double* out) const { add_transposed(Ky_, f_, c, x, out); }
  void add_rate_transposed(double c, const double* x, double* out) const { add_transposed(Zq_, nz_, c, x, out); }

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
  void add(const std::vector<double>& A, int rows, double c, const double* x, double* out) const;
  void add_transposed(const std::vector<double>& A, int rows, double c, const double* x, double* out) const;

  MaggiLevel& level_;
  int n_, m_, f_, nz_;
  double gamma_ = 0;
  std::vector<double> My_, Cy_, Ky_, RQ_, Zq_, Zv_, fz_;
  std::vector<double> D_, A_, column_, lu_;
  std::vector<int> pivots_;
};

}  // namespace costate
