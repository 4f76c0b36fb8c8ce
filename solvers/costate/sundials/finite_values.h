// Trial states and what a system makes of them must be numbers: where not, the integrator tries a shorter step, and if
// no step is short enough the element is named whose formula left its domain.
#pragma once

#include "costate/formulation/system.h"

namespace costate {

/// Throws NoNumber if y (size() entries) holds what is no number.
void require_trial_state(const System& system, double t, const double* y);

/// Throws NotFinite, naming the element, or NoNumber if `values` (size() entries, made of the finite y at t) hold what
/// is no number.
void require_values(System& system, double t, const double* y, const double* values);

/// How far from the time at which the integrator of a run over `span` s gave up what is not finite is its cause: some
/// of its last steps, or those that it has shortened before (ten times by a quarter).
double not_finite_reach(double span, double step);

}  // namespace costate
