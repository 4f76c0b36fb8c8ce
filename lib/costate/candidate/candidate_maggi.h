// The exact adjoint equations of Maggi's formulations, term by term (lib/README.md (5.5), (5.7), (5.9)).
// Independent coordinates are called y = B q here. The reactions are eliminated from the costs first: with s
// = S g_lambda,
//   g^_q = g_q - K^T s,  g^_v = g_v - C^T s,  g^_a = g_a - M s
// and then
//   mu_y'  = -R^T g^_q - D^T g^_v - A^T g^_a + Ky^T mu - f_y^T mu_z
//   mu_yd' = -R^T g^_v - E^T g^_a - mu_y + Cy^T mu - f_yd^T mu_z
//   mu_z'  = -g_z - Q_z^T s - Qy_z^T mu - f_z^T mu_z
//   My mu  = mu_yd + R^T g^_a
//   psi_rho = ends + integral of g_rho - F_rho^T s + N_rho^T g^_q + V_rho^T g^_v + A_rho^T g^_a - Fy^T mu +
//   fy_rho^T mu_z
#pragma once

#include <array>
#include <map>

#include "costate/candidate/candidate_model.h"

namespace costate {

class MaggiModel : public AdjointModel {
 public:
  /// With `kept` mu is an unknown and mu_yd is called P.
  MaggiModel(std::string formulation, bool kept) : AdjointModel(std::move(formulation)), kept_(kept) {}

  std::vector<Group> unknowns() const override;
  Vector rhs(const AdjointBlocks& b, const Vector& mu) const override;
  void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const override;
  Vector integrand(const AdjointBlocks& b, const Vector& mu) const override;
  Vector start_contribution(const AdjointBlocks& b, const Vector& mu, const Matrix& Sq0, const Matrix& Sv0,
                            const Matrix& Sz0) const override;

 private:
  /// What Ky, Cy, Fy, f_y and fy_rho consist of.
  struct Constituents {
    Matrix Ma_q, Phi_lambda_q, Q_q, C_D, M_times_A, C_R,
        M_times_E;  // R^T (M a)_q R, ..., R^T C D = -R^T Q_v D
    Matrix Ma_rho, Phi_lambda_rho, Q_rho, K_N, C_V, M_times_A_rho;
    Matrix f_q, f_v, f_q_N, f_v_V;
    Eigen::LDLT<Matrix> mass;
  };
  /// A cost's gradient without reactions, and s.
  struct Reduced {
    Vector s, q, v, a;
  };
  const Constituents& constituents(const AdjointBlocks& b) const;
  /// Its terms are shared by all equations.
  Reduced without_reactions(const AdjointBlocks& b, bool terminal) const;
  /// The running cost's, and mu, given or solved for.
  Reduced inner(const AdjointBlocks& b, const Vector& x, Vector& mu) const;

  bool kept_;
  /// By time: a model belongs to one motion, on which two choices of coordinates never meet at a point that
  /// is evaluated with both but for the ends of pieces; these are told apart by B.
  mutable std::map<double, std::pair<Matrix, Constituents>> known_;
};

}  // namespace costate
