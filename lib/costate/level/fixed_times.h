// Gradients hold the times fixed at which the law of a driver has a kink or a jump of its curvature, or a force jumps:
// where a parameter moves such a time, the derivatives under the integral miss what the moved jump does. These throw
// CapabilityError then, with the parameter, the element and the time.
#pragma once

#include <vector>

#include "costate/mechanism/mechanism.h"

namespace costate {

/// The times at which laws of drivers have kinks, in order; `numbers` are those of the mechanism.
std::vector<double> driver_kinks(const Mechanism& mechanism, const std::vector<double>& numbers);

/// For the kink at time t; `numbers` are those of the mechanism, with the parameters' values in them.
void require_fixed_kink(const Mechanism& mechanism, const ParameterSelection& parameters,
                        const std::vector<double>& numbers, double t);

/// For every jump of a driver's acceleration within t_start < t < t_end.
void require_fixed_accelerations(const Mechanism& mechanism, const ParameterSelection& parameters,
                                 const std::vector<double>& numbers, double t_start, double t_end);

/// For every jump of a force by its law of time within t_start < t < t_end.
void require_fixed_force_jumps(const Mechanism& mechanism, const ParameterSelection& parameters,
                               const std::vector<double>& numbers, double t_start, double t_end);

}  // namespace costate
