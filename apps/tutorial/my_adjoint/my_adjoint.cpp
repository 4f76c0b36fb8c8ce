// An adjoint of one's own: index 1, explicit first order (lib/README.md, section 3). Build it with
//   find_package(costate REQUIRED)
//   costate_add_candidate(my_adjoint my_adjoint.cpp)
// and let the tool set it beside IDAS:
//   costate check five_bar.toml --candidate ./my_adjoint.so
// Leave out or negate any term below, and the tool names it.
#include "costate/candidate/candidate.h"

namespace {

using costate::AdjointBlocks;

class MyAdjoint final : public costate::CandidateAdjoint {
 public:
  std::string formulation() const override { return "index1"; }

  // Unknowns: mu_q (n), mu_v (n), mu_z (nz); this is the default of unknowns().
  Vector rhs(const AdjointBlocks& b, const Vector& mu) const override {
    const auto mu_q = mu.head(b.n), mu_v = mu.segment(b.n, b.n), mu_z = mu.tail(b.nz);
    const Vector s = b.solve_kkt(mu_v + b.g_a, b.g_lambda);
    const auto s1 = s.head(b.n), s2 = s.tail(b.m);
    Vector rate(mu.size());
    rate.head(b.n) = -b.g_q + b.K.transpose() * s1 + b.Phidd_q.transpose() * s2 - b.f_q.transpose() * mu_z;
    rate.segment(b.n, b.n) =
        -b.g_v - mu_q - b.Q_v.transpose() * s1 + 2 * b.Phid_q.transpose() * s2 - b.f_v.transpose() * mu_z;
    rate.tail(b.nz) = -b.g_z - b.Q_z.transpose() * s1 - b.f_z.transpose() * mu_z;
    return rate;
  }

  // A terminal cost of positions, velocities and states only; with accelerations they have to be eliminated first.
  void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const override {
    mu << b.w_q, b.w_v, b.w_z;
    gradient += b.w_rho;
  }

  Vector integrand(const AdjointBlocks& b, const Vector& mu) const override {
    const Vector s = b.solve_kkt(mu.segment(b.n, b.n) + b.g_a, b.g_lambda);
    return b.g_rho - b.F_rho.transpose() * s.head(b.n) - b.Phidd_rho.transpose() * s.tail(b.m) +
           b.f_rho.transpose() * mu.tail(b.nz);
  }

  // start_contribution(): the default mu_q^T Sq0 + mu_v^T Sv0 + mu_z^T Sz0.
};

}  // namespace

COSTATE_CANDIDATE(MyAdjoint)
