// The times at which the law of a driver has a kink or a jump of its curvature, or a force or a cost jumps by its
// law of time.
// Where a parameter moves such a time, the derivatives under the integral miss what the moved jump does: it has to be
// carried across (impulse_jump.h), or refused with the parameter, the element and the time.
#pragma once

#include <vector>

#include "costate/mechanism/mechanism.h"
#include "costate/objective/objective.h"

namespace costate {

/// The times at which laws of drivers have kinks, in order; `numbers` are those of the mechanism.
std::vector<double> driver_kinks(const Mechanism& mechanism, const std::vector<double>& numbers);

/// Where laws of time with a number that parameters move have kinks, of forces and running costs, places of any kind,
/// of drivers, and jumps of the second derivative, of posts under tyres: derivatives by numbers jump there, so that the
/// last stage of a step that ends there belongs to its left side.
std::vector<double> kinks_of_moved_laws(const Mechanism& mechanism, const Objective& objective,
                                        const ParameterSelection& parameters, const std::vector<double>& numbers);

/// Where something jumps at a time of its own: kinks and jumps of the second derivative of drivers, and values of laws
/// of time of forces and costs; in order and each once.
std::vector<double> jump_times(const Mechanism& mechanism, const Objective& objective,
                               const std::vector<double>& numbers);

struct MovingInstant {
  double t;
  std::vector<double> by;  // dt/drho, one a parameter
};
/// All such times, kinks or not, that parameters move and whose derivatives are known, in order and each once;
/// `numbers` with the parameters' values in them. with_bends: also those at which nothing jumps but derivatives by the
/// parameters, as second derivatives need them.
std::vector<MovingInstant> moving_instants(const Mechanism& mechanism, const Objective& objective,
                                           const ParameterSelection& parameters, const std::vector<double>& numbers,
                                           bool with_bends = false);

/// Throws CapabilityError for those within t_start < t < t_end that parameters move: of methods that carry them across,
/// where the derivative is not known, or two that coincide would part; of others all. And for those at either end.
void require_fixed_times(const Mechanism& mechanism, const Objective& objective, const ParameterSelection& parameters,
                         const std::vector<double>& numbers, double t_start, double t_end, bool carried);

/// For second derivatives: throws CapabilityError for those of such times, with those of bends, within
/// t_start < t < t_end that are no linear functions of the parameters or would part, and for bends at either end.
void require_even_times(const Mechanism& mechanism, const Objective& objective, const ParameterSelection& parameters,
                        const std::vector<double>& numbers, double t_start, double t_end);

}  // namespace costate
