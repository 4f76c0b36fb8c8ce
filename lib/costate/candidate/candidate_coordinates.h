// The exact adjoint equations of the formulations in all coordinates, term by term: index 1, Baumgarte,
// penalty and augmented Lagrangian (lib/README.md (3.4) to (3.6)), index 3 (1.2) to (1.6) and its stabilised
// index-2 form (2).
#pragma once

#include "costate/candidate/candidate_model.h"

namespace costate {

class CoordinateModel : public AdjointModel {
 public:
  /// With `kept` multipliers s1, s2 are unknowns of acceleration-level formulations, not solved for inside.
  CoordinateModel(std::string formulation, bool kept);

  std::vector<Group> unknowns() const override;
  Vector rhs(const AdjointBlocks& b, const Vector& mu) const override;
  void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const override;
  Vector integrand(const AdjointBlocks& b, const Vector& mu) const override;
  Vector start_contribution(const AdjointBlocks& b, const Vector& mu, const Matrix& Sq0, const Matrix& Sv0,
                            const Matrix& Sz0) const override;

 private:
  struct Solved {
    Vector s1, s2;
  };
  struct Multipliers {
    Vector s1, s2, kappa;  // mu and nu of index 2 and 3 in place of s1 and s2; kappa of index 2, else empty
  };
  bool index3() const { return index3_; }
  Solved solve_kkt(const AdjointBlocks& b, const char* where, const char* names[2], const Vector& top,
                   const Vector& bottom) const;
  Solved solve(const AdjointBlocks& b, const Vector& mu_v) const;
  /// Among the unknowns x, or solved for.
  Multipliers multipliers(const AdjointBlocks& b, const Vector& x) const;
  void terminal_momentum(const AdjointBlocks& b, const Vector& wq, const Vector& wv, const Vector& wz, Vector& mu,
                         Vector& gradient) const;

  bool acceleration_, index3_, kept_;
};

}  // namespace costate
