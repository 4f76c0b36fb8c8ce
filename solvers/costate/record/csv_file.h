// Trajectory tables as CSV: one header row `time [s],coordinates/P1.x [m],...`, then one row per time
// instant. Numbers carry the shortest digits (at most 17) that read back to the same double; non-finite
// ones are nan, inf, -inf. The scene and the settings are not part of a CSV file: use HDF5 to keep them.
#pragma once

#include <filesystem>

#include "costate/record/trajectory_table.h"

namespace costate {

/// Writes time and columns of `table` to `path`, atomically (the file appears complete or not at all).
/// Fields with a comma, quote or line break are quoted as in RFC 4180; lines end in "\n".
/// Throws Error if the table is inconsistent or the file cannot be written.
void write_csv(const std::filesystem::path& path, const TrajectoryTable& table);

/// Reads a file of write_csv back: columns in file order; scene_text and settings are empty.
/// Throws Error, with the line number, for a file that is missing or malformed.
[[nodiscard]] TrajectoryTable read_csv(const std::filesystem::path& path);

}  // namespace costate
