// Whether a force has a kink at a point: where its stiffness or its damping jumps there, what is made of derivatives at
// the point (modes, derivatives of an equilibrium) belongs to one side of it.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "costate/assembly/assembly.h"

namespace costate {

/// The entry of K = -Q_q or C = -Q_v that differs most between the two sides: of the equation of `row`, by the
/// coordinate (or the velocity) `column`.
struct PointKink {
  bool of_velocity = false;
  int row = 0, column = 0;
  double one = 0, other = 0;  // its values
};

/// About (t, q, v, a, lambda, z), by the blocks a 1e-8th of the mechanism to both sides of it in some directions that
/// the constraints allow (of more than 500 coordinates, in any). A jump counts from 1e-5 on of the largest entry of its
/// row or column, where an entry of C counts as that of K for a motion of `rate` 1/s, and masses likewise. Where `rate`
/// is 0 velocities stay and C is not looked at.
std::optional<PointKink> find_point_kink(Assembly& assembly, const StateView& point, double rate);

}  // namespace costate
