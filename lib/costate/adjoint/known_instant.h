// A time t*(rho) at which laws have a kink or jump (level/fixed_times.h), under second derivatives: the state jumps by
// G = (q, v + u, z), with the impulses of the constraints where a driver's velocity jumps (lib/README.md (8.1)),
//   M u + Phi_q^T P = 0,   Phi_q u - P/alpha + Phid(t+, v-) - Phid(t-, v-) = 0,
// and h = t - t*(rho) is its guard. As Impact's (13.16): with multipliers (a, b) of these equations
//   Gamma = w^T u - a^T (M u + Phi_q^T P) - b^T (Phid(t+, v+) - Phid(t-, v-) - P/alpha).
#pragma once

#include <string>
#include <vector>

#include "costate/event/impulse_terms.h"
#include "costate/event/motion_events.h"
#include "costate/level/impulse_balance.h"

namespace costate {

class KnownInstant {
 public:
  KnownInstant(Assembly& assembly, ImpulseBalance& balance) : assembly_(assembly), balance_(balance) {}

  /// The state before it, which stays valid, at the last instant before t*, and the first one behind.
  void prepare(const StateView& before, double behind);
  const Eigen::VectorXd& u() const { return u_; }
  /// u's along d, which is that of the state before it.
  Eigen::VectorXd change(const Variation& d);

  // As MotionEvents has them: of mu^T G, and what that changes by along d.
  MotionEvents::Gradient transition_gradient(const double* mu);
  MotionEvents::Gradient gradient_change(const double* mu, const Variation& d);

 private:
  struct Multipliers {
    Eigen::VectorXd a, b;
  };
  /// Of the balance with these right-hand sides (n + m), in place.
  Multipliers solve(Eigen::VectorXd right);
  /// The changes of (u, P) along d.
  Multipliers changes(const Variation& d);
  /// Gamma's derivatives: those of the multipliers' changes at values of zero, or the changes along d.
  ImpulseDerivatives terms(const Variation& d, const Changing& a, const Changing& b, const Multipliers& du, double* q,
                           double* rho);

  Assembly& assembly_;
  ImpulseBalance& balance_;
  StateView before_, behind_;
  Eigen::VectorXd u_, P_, v_behind_;
};

}  // namespace costate
