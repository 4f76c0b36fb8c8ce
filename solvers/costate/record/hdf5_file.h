// Trajectory tables as HDF5 files, readable by h5py, MATLAB, Julia, HDFView and the h5 command line tools.
//
//   /                  attributes format = "costate-trajectory", format_version = 1
//   /time              float64, length n; attribute unit = "s"
//   /<group>/<name>    float64, length n; attributes unit (text) and column (position in the table, from 0)
//   /events/...        of a run that met some: time and jump, float64, name and mode, text, one entry an event
//   /scene             text: the full TOML of the scene as it was run
//   /settings          text: the settings of the run as JSON
//
// All text is variable-length UTF-8. Tables of more than 4096 rows are chunked and compressed (deflate).
// The files have the format of HDF5 1.8. The same table gives the same bytes: no time stamps are stored.
#pragma once

#include <filesystem>

#include "costate/record/trajectory_table.h"

namespace costate {

/// Writes `table` to `path`, atomically (the file appears complete or not at all). Non-finite numbers in
/// the settings become the strings "nan", "inf", "-inf" (see json_number.h).
/// The file is put together in memory first, which takes its size once more for the moment.
/// Throws Error if the table is inconsistent (see TrajectoryTable::require_consistent) or writing fails.
void write_hdf5(const std::filesystem::path& path, const TrajectoryTable& table);

/// Reads a file of write_hdf5 back, columns in their original order.
/// Throws Error if the file is missing, is not HDF5, has another format or a newer version, or is damaged.
[[nodiscard]] TrajectoryTable read_hdf5(const std::filesystem::path& path);

}  // namespace costate
