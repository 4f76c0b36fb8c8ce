// Feet alike that pass each other: where the one is ahead of the other from there on, or no more, both are at one
// place. What comes to the ground within errors of that is let pass.
#pragma once

#include <cmath>

#include "costate/assembly/gathered_state.h"
#include "costate/element/conditional_guard.h"
#include "costate/element/guarded_force.h"

namespace costate {

/// Of the force's guard k, with this value where its condition on another point comes or ceases, or zero where it
/// holds: whether the other point is in the place of its own, along the plane and above it, but for errors [m].
inline bool meets_alike(const Force& force, const GuardedForce& guarded, int k, const StateView& s,
                        const Assembly& assembly, double value, double errors) {
  const auto* conditional = dynamic_cast<const ConditionalGuard*>(&guarded);
  if (!conditional) return false;
  GatheredState gathered;
  const ConditionalGuard::Other other = conditional->other(k, gathered.of(force, s, assembly.numbers()));
  return std::abs(other.ahead) <= errors && std::abs(other.guard - value) <= errors;
}

}  // namespace costate
