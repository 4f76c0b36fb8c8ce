// What the adjoint of an explicit scheme asks of an ODE at each stage: its transposed derivative along a weight, and
// the cost's with a factor of its own, in one evaluation.
#pragma once

#include "costate/formulation/system.h"

namespace costate {

class StageAdjoint {
 public:
  virtual ~StageAdjoint() = default;
  /// pulled = f_y^T w + c g_y^T (set, size() entries); gradient += w^T f_rho + c g_rho.
  virtual void pull_stage(double t, const double* y, const double* w, double c, double* pulled, double* gradient) = 0;
};

}  // namespace costate
