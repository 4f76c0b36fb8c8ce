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

  // What an evaluation has solved may be kept, so that pull_stage() need not solve it again.
  /// Numbers that a record takes, 0 where none are kept; once something has been evaluated.
  virtual std::size_t record_size() const { return 0; }
  /// Of the point of the last rhs().
  virtual void keep_record(double*, std::size_t /*size*/) const {}
  /// The next pull_stage() at (t, y) goes by the record of that point; false where it cannot.
  virtual bool bring_back(double, const double*, const double*) { return false; }
};

}  // namespace costate
