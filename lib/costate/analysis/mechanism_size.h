// How large a mechanism is: what steps of an iteration, and distances from a first guess, are measured by.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "costate/assembly/assembly.h"

namespace costate {

/// What is shorter is the rounding of coordinates that are zero, m.
inline constexpr double kNoLength = 1e-20;

/// The extent of all points and of all coordinates that are lengths, at q; 1 where they all lie in one place; none
/// where there are no lengths.
std::optional<double> extent_of(const Assembly& assembly, const Eigen::VectorXd& q);

}  // namespace costate
