// The second tangents of a motion from where a slip in space begins from rest, (19.15) of lib/README.md: with S the
// tangents by all states and parameters and D the change along a direction of a Hessian,
//   S' = f_x S + f_rho drho,   (D S)' = f_x D S + D(f_x, f_rho) (S, drho)
// and psi's running part g likewise. The slip's direction turns without bound on the way back there; forward it settles
// at once.
#pragma once

#include "costate/adjoint/hessian_equations.h"

namespace costate {

/// dx+ = X (dx, drho) and dpsi = c^T (dx, drho) as StretchMap has them, and their changes along each direction.
struct SecondStretchMap {
  Eigen::MatrixXd X;
  Eigen::VectorXd c;
  std::vector<Eigen::MatrixXd> dX;
  std::vector<Eigen::VectorXd> dc;

  /// mu and dmu behind the stretch become those before it; gradient (np) and products (np x k) gain theirs.
  void pull(double* mu, double* dmu, double* gradient, double* products) const;
};

/// The rates of S and its changes: of (f_x, f_rho; g_x, g_rho) and its changes, (N + 1) x M each.
std::vector<Eigen::MatrixXd> tangent_rates(const std::vector<Eigen::MatrixXd>& of,
                                           const std::vector<Eigen::MatrixXd>& tangents);

class SecondTangents {
 public:
  /// At these parameters, of the stabilization and along the directions of `of`.
  SecondTangents(const HessianEquations& of, const Objective& objective);

  int state_size() const { return N_; }
  int columns() const { return M_; }
  int directions() const { return k_; }

  /// S of (x, psi) and its changes, (N + 1) x M each, at the event's time: behind it, of columns that count before it.
  /// `shifts`: of its instant along each direction.
  std::vector<Eigen::MatrixXd> begin(const HessianEquations::Event& event, const Eigen::VectorXd& shifts);
  /// At a point on the way, y = (x, its tangents along the directions).
  std::vector<Eigen::MatrixXd> begin(const std::vector<double>& y);
  /// x' and (f_x, f_rho), N x M.
  void rates(double t, const double* x, Eigen::VectorXd& f, Eigen::MatrixXd& A);
  /// What w is the sum of (parts_of_slips()) where rates() were evaluated last, which was at x.
  double parts_of_slips(const double* x) const;
  /// (f_x, f_rho; g_x, g_rho) and its changes as x changes by S's part along the directions, (N + 1) x M each.
  void changes(double t, const double* x, const Eigen::MatrixXd& S, std::vector<Eigen::MatrixXd>& all);
  /// S along the directions, N x k.
  Eigen::MatrixXd along(const Eigen::MatrixXd& S) const { return S.topRows(N_) * combined_; }
  SecondStretchMap map(const std::vector<Eigen::MatrixXd>& tangents) const;

 private:
  void hold(const HessianEquations::Event& event, std::vector<Eigen::MatrixXd>& tangents);

  Assembly assembly_;
  AccelerationLevel level_;
  HessianEquations all_, along_;  // with a direction for each column; along those of the Hessian
  int n_, N_, M_, k_;             // coordinates; states; states and parameters; directions
  Eigen::MatrixXd combined_;      // (dx, drho) of each direction at the beginning, a column each
  Eigen::MatrixXd unit_;          // tangents of all_
};

}  // namespace costate
