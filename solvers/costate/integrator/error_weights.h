// The weights of IDAS's norms: 1 / (rtol |y| + atol), and for accelerations and multipliers not below what rounding
// makes of them. These follow from differences of the velocities over a step h, so that an accuracy finer than eps |v|
// / h is noise: with an absolute tolerance alone Newton's test would fail wherever one of them passes through zero.
#pragma once

#include <vector>

#include "costate/formulation/system.h"

namespace costate {

/// Returns 0, or -1 where a weight would not be positive. atol as in IDASVtolerances; h is 0 before the first step.
int set_error_weights(const std::vector<Unknown>& unknowns, const double* y, double rtol, const double* atol, double h,
                      double* weights);

}  // namespace costate
