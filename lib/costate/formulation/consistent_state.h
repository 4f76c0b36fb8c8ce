// Consistent states of DAE formulations that have accelerations and multipliers as unknowns,
//   y = (q, v, z, a, lambda, ...),
// with everything behind lambda zero on the solution: how (q, v, z) become a consistent (y, y'), at a start
// and after a jump of the velocities.
#pragma once

#include "costate/analysis/start.h"
#include "costate/level/velocity_jump.h"

namespace costate {

class ConsistentState {
 public:
  /// size: entries of y.
  ConsistentState(Assembly& assembly, AccelerationLevel& level, int size)
      : assembly_(assembly), level_(level), jump_(assembly, level), size_(size) {
    assembly.resize(columns_);
  }

  StateView view(double t, const double* y) const;
  /// a, lambda and y' for the (q, v, z) that y holds; `level` has solved there.
  void complete(double t, double* y, double* yp);
  /// The same for columns (s, s') of sensitivities, where the state was completed last: (3.3).
  void complete_columns(double* const* s, double* const* sp, int count);
  /// The start of the scene at t, with its columns by parameters if asked for, as (y, y').
  Start start(double t, bool columns, double* y, double* yp);
  ImpulseBalance& balance() { return jump_.balance(); }
  /// (y, y') := the state after the jump from t to t_after.
  void jump(double t, double t_after, double* y, double* yp);
  /// The same, and (q, v, z) of the columns s go across.
  void jump_tangent(double t, double t_after, double* y, double* yp, double* const* s, int count,
                    const MovingTime* moving);
  void jump_adjoint(double t, double t_after, const double* y, double* mu, double* gradient, const MovingTime* moving);

 private:
  void take(const double* v, double t_after, double* y, double* yp);

  Assembly& assembly_;
  AccelerationLevel& level_;
  VelocityJump jump_;
  Assembly::ParameterColumns columns_;
  int size_;
};

}  // namespace costate
