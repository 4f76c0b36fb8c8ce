// What happens where a driver's law has a kink: at a time t* the driven velocity Phi_t jumps, the positions do not, and
// the velocities jump so that they balance the impulse P of the constraints (lib/README.md (8.1)):
//   [M  Phi_q^T] [v+ - v-]   [          0           ]
//   [Phi_q  -1/alpha] [P]  = [-(Phi_t(t*+) - Phi_t(t*-))]
// (1/alpha = 0 but in penalty formulations), with the exact derivatives of v+ with respect to the state before and to
// the parameters. Where these move t* itself, the state before goes on, or stops, on its way, and the one behind starts
// later: with x = (q, v, z) and G the jump, dx+ = G_x (dx- + x'- dt*) + G_t dt* - x'+ dt* + G_rho drho. The same with
// P = 0 serves where forces or driven accelerations jump at such a time.
#pragma once

#include <memory>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/level/impulse_balance.h"

namespace costate {

/// How a time t* moves with the parameters, and what the state does on either side.
struct MovingTime {
  std::vector<double> by;             // dt*/drho, np
  std::vector<double> before, after;  // (q', v', z'), 2 n + nz each
  double cost = 0;                    // the running cost before less that behind
};

class ImpulseJump {
 public:
  ImpulseJump(Assembly& assembly, std::unique_ptr<ImpulseBalance> balance)
      : assembly_(assembly), balance_(std::move(balance)) {}

  ImpulseBalance& balance() { return *balance_; }

  /// v+ (n entries, until the next call) for the state before the jump (q, v, z), with the instants on either side.
  const double* calc(const StateView& before, double t_after);

  /// v+ again, and v columns become those after it; the columns y hold (q, v, z).
  const double* tangent(const StateView& before, double t_after, double* const* y, int count,
                        const MovingTime* moving = nullptr);
  /// mu of (q, v, z) after becomes that before; the gradient gains mu_v^T (v+)_rho, and what a moving time brings.
  void adjoint(const StateView& before, double t_after, double* mu, double* gradient,
               const MovingTime* moving = nullptr);

 private:
  /// The blocks of d(v+ - v-) with respect to q and rho; `columns` with those of all parameters, too.
  void linearize(const StateView& before, double t_after, bool columns);

  Assembly& assembly_;
  std::unique_ptr<ImpulseBalance> balance_;
  std::vector<double> solution_;          // v+ - v-, P
  std::vector<double> after_;             // v+
  std::vector<double> hessian_, phid_q_;  // (M dv + Phi_q^T P)_q; Phidot_q after less before
  std::vector<double> phid_t_;            // Phidot_t likewise
  Eigen::MatrixXd force_, phid_;          // the same by rho
};

}  // namespace costate
