// What a run tells of its events, whatever carries it: those at its ends, in one instant, those that errors decide.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "costate/event/grazing_watch.h"
#include "costate/event/motion_events.h"
#include "costate/problem/problem.h"

namespace costate {

/// What there is to say of the touch that is most nearly missed, if errors may decide whether it comes: how many
/// tolerances deep it is, and a sentence.
std::optional<std::pair<double, std::string>> grazed_touch(const GrazingWatch& watch, double rtol);
/// Of a touch that is let pass, or not, as it comes a hair above or below the ground to where it may touch: a sentence.
std::optional<std::string> touch_let_pass(const MotionEvents& events, double rtol);
/// The sentences as notices (events: or null), or for a gradient as a SolverError where it is too near.
void tell_of_grazing(const GrazingWatch& watch, const MotionEvents* events, double rtol);
void refuse_grazing(const GrazingWatch& watch, double rtol);

/// Of what happens in the instant in which the run ends, or begins (for gradients); `kinks` are those of drivers.
void tell_of_end(const Problem& problem, const Simulation& result, const std::vector<double>& kinks);
void tell_of_start(const Problem& problem, const Simulation& result);
/// Of a gradient where the order of two events decides, or of an event and a jump of a law of time; `numbers` are those
/// of the mechanism.
void tell_of_coincident(const Problem& problem, const std::vector<double>& numbers,
                        const std::vector<RunEvent>& events);

}  // namespace costate
