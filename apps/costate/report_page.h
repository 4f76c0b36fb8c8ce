// The page that a run leaves for a person: one HTML file with its plots inside as SVG and its motion in 3-D. It needs
// nothing from elsewhere, is read without scripts as well, and is well-formed XML of a bounded size.
#pragma once

#include "optimize_motions.h"

namespace costate::app {

/// costate optimize: what was run, why it stopped, parameters and cost before and after, the certificate, both over the
/// evaluations, and of each run the motion before and after, where both are there. `summary` is what optimize.json
/// holds.
std::string optimize_page(const Setup& setup, const Json& summary, const std::vector<RunMotion>& motions);

/// costate simulate --report: what was run and the motion.
std::string simulate_page(const Setup& setup, const Json& summary, const TrajectoryTable& motion);

}  // namespace costate::app
