// Whether a parameter is on one of its bounds.
#pragma once

#include "costate/mechanism/parameter.h"

namespace costate {

/// In parts of its scale: SLSQP and MMA stop some 2e-8 inside, and places this near to each other are one.
inline constexpr double kOnBound = 1e-6;

inline bool on_lower(const Parameter& p, double value) { return value <= p.lower + kOnBound * p.scale; }
inline bool on_upper(const Parameter& p, double value) { return value >= p.upper - kOnBound * p.scale; }

}  // namespace costate
