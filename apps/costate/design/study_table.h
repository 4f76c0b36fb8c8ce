// What a study says of its runs: rows for JSON, tables for people and for spreadsheets.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/study/study_job.h"

namespace costate::app {

Json study_row(const StudyJob& job);

/// Of all rows.
std::string study_csv(const Json& rows);
std::string study_table(const std::string& title, const Json& rows);

/// The rows of each design, in order.
std::vector<std::pair<std::string, std::vector<Json>>> rows_by_design(const Json& rows);

/// For each design its name and a table with a row a point: what was varied, psi, outputs, gradient, the optimum.
std::vector<std::pair<std::string, std::string>> design_csvs(const Json& rows);

/// By design: the sensitivity of those that tell of it (indices.h).
Json study_sensitivity(const Json& rows);

/// A finished run in a line.
std::string study_sentence(const Json& result);

}  // namespace costate::app
