// The positions that a scene's numbers begin with, and which of two ways angles are meant (element/angle_row.h). An
// angle that stands more than an eighth of a turn from what it is the angle of begins there, at the nearest of its
// turns: the start then leads both to where the angle is given, instead of half a turn away.
#pragma once

#include <Eigen/Core>

#include "costate/assembly/assembly.h"

namespace costate {

/// Of the numbers that the assembly holds (n).
Eigen::VectorXd first_guess(const Assembly& assembly, double t);

/// ModelError if an angle is that of the opposite direction.
void require_angles(const Assembly& assembly, double t, const Eigen::VectorXd& q);

}  // namespace costate
