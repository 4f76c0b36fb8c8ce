// What a run tells of its events, whatever carries it: those at its ends, in one instant, those that errors decide.
#pragma once

#include <string>
#include <vector>

#include "costate/analysis/own_jump_watch.h"
#include "costate/event/grazing_watch.h"
#include "costate/event/idle_contact_watch.h"
#include "costate/event/motion_events.h"
#include "costate/event/slip_offset_watch.h"
#include "costate/problem/problem.h"

namespace costate {

/// In rtol of the run's length: what the time of an event is off by.
inline constexpr double kTimesOff = 10;

/// Touches that errors may decide, of a gap that is grazed or of a condition that is nearly met (events: or null):
/// notices; of a gradient a SolverError where the gap is too near.
void tell_of_grazing(const GrazingWatch& watch, const MotionEvents* events, double rtol);
void refuse_grazing(const GrazingWatch& watch, double rtol);

/// What the offset of a slow slip from rest leaves in results, in parts of them, with a notice; 0 where that is nothing
/// to speak of.
double tell_of_offset(const SlipOffsetWatch& watch, double rtol);

/// Of a gradient where a closed contact bears nothing: psi may have a kink there.
void tell_of_idle(const IdleContactWatch& watch);

/// Of a motion where a user's constraint asks for a velocity that jumps.
void tell_of_own_jumps(const OwnJumpWatch& watch);

/// Of what happens in the instant in which the run ends, or begins (for gradients); `kinks` are those of drivers.
void tell_of_end(const Problem& problem, const Simulation& result, const std::vector<double>& kinks);
void tell_of_start(const Problem& problem, const Simulation& result);
/// Of running costs on accelerations or reactions where velocities jump: impulses are in none of their integrals.
void tell_of_impulses(const Problem& problem, const Simulation& result, const std::vector<double>& kinks);
/// Of an impact that comes, as the end has it, within an instant behind the end, where a terminal cost is.
void tell_of_impact_behind(const Problem& problem, const Assembly& assembly, const StateView& end, GrazingWatch& watch);
/// Of a sample of the cost in the instant of an event.
void tell_of_samples(const Problem& problem, const std::vector<RunEvent>& events);
/// Of a gradient where the order of two events decides, or of an event and a jump of a law of time; `numbers` are those
/// of the mechanism.
void tell_of_coincident(const Problem& problem, const std::vector<double>& numbers,
                        const std::vector<RunEvent>& events);

}  // namespace costate
