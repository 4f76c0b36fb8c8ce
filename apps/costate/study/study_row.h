// What a study keeps of each of its runs: a row of study.json, from which its tables are made.
#pragma once

#include <string>

#include "costate/study/study_job.h"

namespace costate::app {

/// Name, status and, of a run that has ended well, what its task found. A fit is an optimization of its sum of squares,
/// with "standard_errors"; "outputs" are those of a simulation's end, and of a cycle period_s, multiplier (the largest
/// modulus), stable and, where it travels, speed_m_per_s.
Json study_row(const StudyJob& job);

/// A row's psi and outputs in a line.
std::string numbers_text(const Json& row);

/// A finished run in a line.
std::string study_sentence(const StudyJob& job);

}  // namespace costate::app
