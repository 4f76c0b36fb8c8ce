// Where a force has a kink along a motion: where C = -Q_v, f_v or g_v jumps. First-order adjoints hold these blocks as
// they are and need not know; second-order ones hold their time derivatives, so that a kink is an event of theirs
// (lib/README.md (4.4)). They are found along the stored motion (adjoint/block_jumps.h).
#pragma once

#include <functional>
#include <vector>

#include "costate/adjoint/motion_jump.h"
#include "costate/assembly/assembly.h"
#include "costate/objective/objective.h"

namespace costate {

/// An instant before a kink and one behind it, as near as numbers tell them apart, with (q, v, z) there: no step is to
/// be made between them.
struct ForceKink {
  double before = 0, after = 0;
  std::vector<double> state_before, state_after;
};

/// `times`: the ends of the motion's steps in order, `motion` its (q, v, z). Where the motion itself jumps the
/// equations are carried across as a whole (HandEquations::cross): those places are left out.
std::vector<ForceKink> find_force_kinks(Assembly& assembly, const Objective& objective,
                                        const std::vector<double>& times,
                                        const std::function<void(double t, double* qvz)>& motion,
                                        const std::vector<MotionJump>& jumps);

/// The kink behind which t is, or null.
const ForceKink* kink_before(const std::vector<ForceKink>& kinks, double t);
/// The instants of kinks, both of each, for a grid.
void append_times(const std::vector<ForceKink>& kinks, std::vector<double>& times);

}  // namespace costate
