// In which units NLopt sees a cost and its constraints. What its line searches and conditions of optimality ask for is
// in part absolute, as if all were of the size of one: a psi of 1e5 ended SLSQP at its start, one of 1e-10 L-BFGS.
#pragma once

#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

/// Of psi where a search begins: it goes on for no less, of a psi that falls to zero.
inline constexpr double kNothingOfStart = 1e-16;

/// Powers of ten near the larger of a value and its largest derivative in scaled parameters; 1 where that is between
/// 1e-3 and 1e3, or nothing.
struct OptimizerUnits {
  double psi = 1;
  std::vector<double> constraints;
};
OptimizerUnits optimizer_units(const ParameterSelection& parameters, const OptimizerEvaluation& first,
                               const std::vector<DesignBound>& bounds);

}  // namespace costate
