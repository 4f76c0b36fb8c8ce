// Whether a motion is what its tolerance claims. A tolerance bounds the error of each step; where the
// motion makes much of small errors (an unstable rotation, a pendulum at the top) psi and outputs may be off by their
// whole range, and no equation of the run itself says so. The same motion at a tenth of the tolerance does. psi alone
// would not: it may agree by chance, or by a symmetry, where the motions do not.
#pragma once

#include "costate/tradeoff/trade_probe.h"

namespace costate {

/// What a tolerance claims of psi and of each output along a motion, relative to their sizes: kClaim tolerances.
struct MotionClaim {
  static constexpr double kClaim = 1e4, kMost = 0.3;
  static double of(double rtol);
};

/// Whether motions of this problem are confirmed: from rtol 1e-11 on, below which there are no tighter ones. From 1e-2
/// on a run promises nothing, and says so itself; with a step of the user's it never does.
bool motion_is_confirmed(const Problem& problem);

/// What a motion of this problem is confirmed by: its coordinates and what is `asked` for (names of outputs), at tight
/// tolerances its accelerations, too, which may have far fewer digits.
std::vector<std::string> confirmed_outputs(const Problem& problem, const std::vector<std::string>& asked);

/// A run at rho whose samples go to the recording, with others that tell what it is worth, where it is to be confirmed
/// (`problem.solver.confirm` and motion_is_confirmed).
GradientResult confirmed_simulation(const Problem& problem, const std::vector<double>& rho,
                                    const TradeProbe::Recording& to, const std::vector<std::string>& asked);

/// Gives notice where psi or an output of the probe, at its samples, changes by more than a third of the claim from
/// `values`, those of `problem`, to a tenth of its tolerance. Below rtol 1e-6 a run at 100 times the tolerance is asked
/// first, which is cheap, and that one only where outputs or the energy change by more than a thousandth; told is then
/// what still changes by more than a tenth of that. Of fixed steps that were chosen runs by twice and half of them, and
/// three thousandths. Cut passes through.
void confirm_motion(const TradeProbe& probe, const Problem& problem, const TradeValues& values,
                    Simulation* result = nullptr);

}  // namespace costate
