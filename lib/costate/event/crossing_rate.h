// How fast a guard crosses zero along the motion: by that the time of its event moves.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "costate/base/error.h"

namespace costate {

/// Throws SolverError where the rate is rounding of the terms (their sizes added up) that make it up.
inline void require_crossing(double t, const std::string& event, double rate, double terms) {
  constexpr double kGrazes = 1e-7;
  if (!(std::abs(rate) > kGrazes * terms))
    throw SolverError(
        fmt::format("At t = {:.9g} s '{}' is grazed: its guard changes by {:.3g} per second, of terms of {:.3g}. The "
                    "time of the event has no derivative there. Move the motion away from grazing.",
                    t, event, rate, terms));
}

}  // namespace costate
