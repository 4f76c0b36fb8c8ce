// Which outputs of a scene matter to a reader: those of its cost and of [run], for reports and comparisons.
#pragma once

#include "command.h"
#include "costate/record/trajectory_table.h"

namespace costate::app {

/// The outputs that the terms of the cost name, targets included; then those of [run] outputs; then those of the
/// constraints. Each once, all of them outputs of the scene's mechanism.
std::vector<std::string> outputs_of_interest(const Scene& scene);

/// The output that a column holds: NAME, NAME_dot, NAME_ddot, lambda.ROW, z.STATE.
std::string output_of_column(const Column& column);

/// The column of a trajectory that holds an output, or null. (Time has no column of its own.)
const Column* column_of_output(const TrajectoryTable& table, const std::string& output);

}  // namespace costate::app
