// A latch between two angles, or of one (element/force/latch.h).
#pragma once

#include <string>
#include <vector>

#include "costate/mechanism/builder.h"

namespace costate {

struct LatchOptions {
  double stiffness_N_m_per_rad = 0, damping_N_m_s_per_rad = 0;
  double angle_rad = 0;          // where it catches, and what it holds
  bool from_above = true;        // it catches what falls to that angle; else what rises to it
  bool holds = false;            // at the start
  std::string release_point;     // lets go where it comes down to the ground; empty: nothing does
  std::string release_ahead_of;  // and only where it is ahead of this point; empty: everywhere
  double release_radius_m = 0, ground_x_m = 0, ground_height_m = 0, ground_angle_rad = 0;
};

/// Throws ModelError at latch.NAME.KEY: unknown angles or points, numbers out of range.
void add_latch(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
               const LatchOptions& o);

}  // namespace costate
