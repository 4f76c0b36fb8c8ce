// Whether a mechanism has forces with events (element/guarded_force.h): contacts that touch and let go.
#pragma once

#include <algorithm>

#include "costate/element/guarded_force.h"
#include "costate/mechanism/mechanism.h"

namespace costate {

inline bool has_guarded_forces(const Mechanism& mechanism) {
  return std::any_of(mechanism.forces().begin(), mechanism.forces().end(), [](const auto& f) {
    const auto* g = dynamic_cast<const GuardedForce*>(f.get());
    return g && g->guard_count() > 0;
  });
}

}  // namespace costate
