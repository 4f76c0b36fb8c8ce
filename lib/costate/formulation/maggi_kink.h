// The kinks of drivers in independent coordinates: y and the force states stay, yd jumps to B v+ (lib/README.md
// (5.13)). All three work at the solved point of the level, the last one before the kink, in the chart in force, and
// leave the level to be solved anew. Where rows come and go impulses are solved for as accelerations are, in the
// equations with multipliers: behind an event of a contact the rows are others than those of the chart in force.
#pragma once

#include "costate/level/impulse_jump.h"
#include "costate/level/maggi_level.h"

namespace costate {

class MaggiKink {
 public:
  explicit MaggiKink(MaggiLevel& level);

  ImpulseBalance& balance() { return jump_->balance(); }
  /// yd behind the kink.
  void cross(double t_after, double* yd);
  /// Columns (dy, dyd, dz), one a parameter, before the kink become those behind it; at the linearized point.
  void tangent(double t_after, double* const* s, int count, const MovingTime* moving);
  /// Adjoints (mu_y, mu_yd, mu_z) behind the kink become the weights of (q, v, z) before it, which the level then
  /// pulls back; the gradient gains the jump's own dependence on the parameters.
  const ScalarGradient& adjoint(double t_after, const double* mu, double* gradient, const MovingTime* moving);

 private:
  MaggiLevel& level_;
  std::unique_ptr<ImpulseJump> jump_;
  ScalarGradient weights_;
};

}  // namespace costate
