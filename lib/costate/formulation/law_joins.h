// Laws whose pieces do not meet, before runs and gradients. The instant at which a motion comes to a jump of a force
// moves with every parameter, and what that does to the motion is in none of the derivatives; a driver's position
// cannot jump at all. These throw CapabilityError with the law, the place and what to do.
#pragma once

#include <vector>

#include "costate/mechanism/mechanism.h"

namespace costate {

/// For gradients: forces that jump somewhere along what their law depends on (a spring's length, a road), parameters
/// that part such a law's pieces, and parameters that open a jump or a kink of a driver's law within t_start < t <
/// t_end. `numbers` are those of the mechanism, with the parameters' values in them.
void require_joined_laws(const Mechanism& mechanism, const ParameterSelection& parameters,
                         const std::vector<double>& numbers, double t_start, double t_end);

/// For every run: drivers whose position jumps within t_start < t < t_end.
void require_joined_drivers(const Mechanism& mechanism, const std::vector<double>& numbers, double t_start,
                            double t_end);

/// Where a force may bend along the motion, other than where event/bend_watch.h tells the time. The derivative of a
/// step over such a place has an error of the first order of its length.
enum class Bends {
  none,
  at_touches,  // where something touches or leaves, or while it touches
  anywhere     // where a road has a corner or the pieces of a law meet, too
};
Bends bends_of(const Mechanism& mechanism, const std::vector<double>& numbers);

}  // namespace costate
