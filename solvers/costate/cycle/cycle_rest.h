// Whether a fixed point of the return map is a cycle, or an equilibrium that the motion dies out towards: a section is
// met there as well, by what rounding and the tolerances leave of the motion.
#pragma once

#include "costate/cycle/cycle_start.h"
#include "costate/cycle/return_map.h"

namespace costate {

/// Whether nothing moves from x on for `time` [s], the length of a cycle: each coordinate and force state stays within
/// its tolerance; or within 1000 of them and a thousandth of what it goes through where the search begins.
bool rests(const ReturnMap& map, const CycleStart& start, const Eigen::VectorXd& x,
           const std::vector<double>& positions, double time);

}  // namespace costate
