// The tables of a study as one HDF5 file, readable by h5py, MATLAB, Julia and the h5 command line tools.
//
//   /                         attributes format = "costate-study", format_version = 1, title
//   /runs/...                 the table of study.csv: a dataset a column, an entry a run
//   /designs/<name>/...       that of <name>.csv, an entry a point; attributes scene and task
//
// Columns stand in groups by what they are: varied, outputs, cases, gradient, period_gradient, speed_gradient,
// multiplier_gradient, parameters_before, parameters_after and standard_errors, each with a dataset a name; name,
// status, psi and the like stand without one. Attributes of a dataset: heading (what stands over the column in the CSV)
// and column (its place there, from 0). Numbers are float64, to the bit those of the CSV: a missing one is NaN, yes is
// 1 and no is 0. Names, status, stop_reason, verdict, and error, which the CSV does not have, are variable-length
// UTF-8, empty where they are missing. A slash in a name is a bar (|) in that of its dataset. The same tables give the
// same bytes.
#pragma once

#include <filesystem>
#include <string>

#include "costate/json_text.h"

namespace costate::app {

/// Writes the tables of these rows (study_row.h), atomically. Throws Error where that fails.
void write_study_hdf5(const std::filesystem::path& path, const std::string& title, const Json& rows);

}  // namespace costate::app
