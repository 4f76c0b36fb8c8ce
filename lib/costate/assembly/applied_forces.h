// The forces of bodies and elements that are no constants, one after the other; Assembly's own.
#pragma once

#include <algorithm>

#include "costate/assembly/assembly.h"

namespace costate {

/// Calls add(coordinates, f) with each one's local f; zdot gains the rates of their states.
template <class Add>
void Assembly::for_each_varying_force(const StateView& s, double* zdot, const Add& add) {
  double f[kMaxLocal];
  for (const std::size_t b : varying_force_) {
    const Body& body = *mechanism_->bodies()[b];
    const auto& c = body.coordinates();
    std::fill(f, f + c.size(), 0.0);
    body.calc_force(gather(bodies_[b], s), f);
    add(c, f);
  }
  for (std::size_t k = 0; k < forces_.size(); ++k) {
    if (rests(forces_[k], s)) continue;
    const Force& force = *mechanism_->forces()[k];
    const auto& c = force.coordinates();
    std::fill(f, f + c.size(), 0.0);
    force.calc_force(gather(forces_[k], s), f, zdot + forces_[k].row_offset);
    add(c, f);
  }
}

}  // namespace costate
