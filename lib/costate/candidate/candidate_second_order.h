// The exact adjoint equations of second order, term by term (lib/README.md (4.3), (5.8)): unknowns mu and
// mu_dot = mu',
//   M mu_dot' = -2 M' mu_dot + C^T mu_dot - M'' mu + C'^T mu - K^T mu + g_q - (g_v)' + f_q^T mu_z - (f_v^T
//   mu_z)'
// with Mb, Cb, Kb of the penalty or My, Cy, Ky of Maggi for M, C, K. They begin and end with the multipliers
// of first order, mu_v = M mu and mu_q = -g_v - M' mu - M mu_dot + C^T mu - f_v^T mu_z, whose end values are
// those of `First`.
#pragma once

#include "costate/candidate/candidate_coordinates.h"
#include "costate/candidate/candidate_maggi.h"

namespace costate {

template <class First>
class SecondOrderModel final : public First {
 public:
  using typename CandidateAdjoint::Group;
  using typename CandidateAdjoint::Matrix;
  using typename CandidateAdjoint::Vector;
  using Section = AdjointTerm::Section;

  explicit SecondOrderModel(std::string formulation) : First(std::move(formulation), false) {}
  std::vector<Group> unknowns() const override { return CandidateAdjoint::unknowns(); }
  Vector rhs(const AdjointBlocks& b, const Vector& mu) const override;
  void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const override;
  Vector integrand(const AdjointBlocks& b, const Vector& mu) const override;
  Vector start_contribution(const AdjointBlocks& b, const Vector& mu, const Matrix& Sq0, const Matrix& Sv0,
                            const Matrix& Sz0) const override;

 private:
  /// The terms of rest = -g_v - M' mu + C^T mu - f_v^T mu_z, which is mu_q + M mu_dot.
  Vector rest(const AdjointBlocks& b, const char* where, const Vector& mu, const Vector& mu_z) const;
};

}  // namespace costate
