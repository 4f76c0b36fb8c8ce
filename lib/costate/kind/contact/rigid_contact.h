// Rigid contact of points, arcs or spheres with the ground (element/force/rigid_contact.h).
#pragma once

#include <optional>
#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

struct RigidContactOptions {
  double restitution = 0;  // speed after an impact by the speed before, 0 to 1; of poisson's law impulses
  std::string restitution_law = "newton";  // or "poisson"
  double friction_coefficient = 0;         // Coulomb's; 0: there is no friction
  double static_coefficient = -1;          // of sticking; negative: that of sliding
  double closing_speed_m_per_s = 0;        // with a lower approach speed it closes
  bool for_good = false;  // one with restitution bounces for good; if not it closes where bounces die out
  bool closed = false;    // at the start
  int sliding = 0;  // then: 1 or -1 where it slides along the plane or against it (in space 1: along its velocity)
  // Where along the ground what is closed at the start sticks, in space also along y; else where its body is given.
  std::optional<double> along_m, across_m;
  double ground_x_m = 0, ground_height_m = 0, ground_angle_rad = 0;  // goes through (x, height)
  double radius_m = 0;
  std::string ahead_of;  // it closes only where it is ahead of this point; empty: everywhere
};

/// Throws ModelError at contact.NAME.KEY: numbers out of range, a radius of what does not turn.
void add_rigid_contact(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const RigidContactOptions& o);

}  // namespace costate
