// Discrete tangent and adjoint of runs by Runge-Kutta schemes with step control: psi is the sum that the steps form,
// and the gradient is the derivative of that sum with the steps held fixed, to rounding, at every tolerance. At events,
// and at kinks whose time parameters move, the lengths of the steps on either side follow the parameters: by the flow's
// rates there (lib/README.md (9)), to the tolerance.
#pragma once

#include "costate/problem/problem.h"

namespace costate {

/// On the scheme that discrete_integrator_of() names, which is a Runge-Kutta scheme.
GradientResult runge_kutta_tangent(const Problem& problem, const std::vector<double>& rho);
GradientResult runge_kutta_adjoint(const Problem& problem, const std::vector<double>& rho);

}  // namespace costate
