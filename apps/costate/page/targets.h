// What a cost wants of outputs, as curves beside those of a motion: targets and measured samples.
#pragma once

#include "costate/record/svg_plot.h"
#include "costate/record/trajectory_table.h"
#include "costate/scene/scene.h"

namespace costate::app {

/// The targets of `output` in the cost of `scene` at the times of a motion of it: laws at each of them, other outputs
/// as they were recorded, targets of the end as a dot there; and measured samples as dots. Nothing is run for them.
/// A term without a target wants none.
std::vector<SvgCurve> target_curves(const Scene& scene, const std::string& output, const TrajectoryTable& motion);

}  // namespace costate::app
