// Accelerations and multipliers of systems that have them in no norm (index 2): Newton's iteration leaves them as they
// come, and nothing keeps their error from growing. What is computed from them takes those that belong to (t, q, v, z).
#pragma once

#include <limits>
#include <vector>

#include "costate/formulation/system.h"

namespace costate {

/// Such a system's y with those solved for, stabilizers zero; any other system's y as it is.
void solve_algebraic(DaeSystem& system, double t, double* y);

/// The same of a state that is given, kept for further calls at the same time.
class SolvedAlgebraic {
 public:
  void forget() { t_ = std::numeric_limits<double>::quiet_NaN(); }
  const double* at(DaeSystem& system, double t, const double* y);

 private:
  double t_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> y_;
};

}  // namespace costate
