// Angles that are known up to full turns only (a body's roll and yaw, an atan2) jump by a turn where the body turns on.
// A cost along a motion must not pass such a place: its integral would be that of a sawtooth, and the times of the
// jumps, which parameters move, are no part of any gradient.
#pragma once

#include "costate/objective/output.h"

namespace costate {

/// Whether an output is such an angle.
bool folds(const Output& output);

/// Throws CapabilityError when the value of a folded output has jumped since the call before, at an earlier time of the
/// same run (the same assembly, later times).
void watch_fold(const Output& output, const Assembly& assembly, double t, double value);

/// The same for an output at the state s, and for the outputs of its formula where it jumps with them (the sine of a
/// yaw does not).
void watch_folds(const Output& output, const StateView& s, Assembly& assembly);

}  // namespace costate
