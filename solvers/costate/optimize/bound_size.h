// What constraints are measured by: one of 1e-9 m^2 is not kept because it is exceeded by less than 1e-8.
#pragma once

#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

/// Of each bound |upper|, but no less than 1e-6 of what a step of a parameter's scale changes it by at the search's
/// first evaluation; of a bound of 0 that itself; 1 where there is nothing of the kind.
std::vector<double> bound_sizes(const ParameterSelection& parameters, const OptimizerEvaluation& first,
                                const std::vector<DesignBound>& bounds);

/// By how much a constraint of this size may be exceeded and still be kept, at this tolerance of its run: 1e-8 of its
/// size, or as well as it is known, to 1e-7; never more than 1e-8 of the larger of its bound and 1.
double kept_within(double size, double upper, double rtol);

}  // namespace costate
