// The pages of costate gradient --report and costate cycle --report.
#pragma once

#include <optional>

#include "command.h"
#include "costate/record/trajectory_table.h"

namespace costate::app {

/// The motion that psi is of, sampled for a page: of a psi over a cycle the one that begins there. None where it cannot
/// be computed, which gives notice.
std::optional<TrajectoryTable> motion_for_page(const Setup& setup, const Json& settings);

/// Writes the page; what the command's text says of it, empty where it is not there.
std::string written_page(const Setup& setup, const std::string& file, const std::string& page);

/// psi, its derivatives with their errors, how large they are against each other in scaled parameters, and the motion
/// (null: none). `summary` is what gradient.json holds; of several cases each one's derivatives, too.
std::string gradient_page(const Setup& setup, const Json& summary, const TrajectoryTable* motion);

/// A cycle: period, multipliers in the unit circle, how all follow the parameters, and the motion that begins on it.
/// `text` is what the command prints, `summary` what cycle.json holds.
std::string cycle_page(const Setup& setup, const Json& summary, const std::string& text, const TrajectoryTable* motion);

}  // namespace costate::app
