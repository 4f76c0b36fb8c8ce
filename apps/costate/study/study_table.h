// What a study says of its runs (study_row.h): tables for people and for spreadsheets.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/json_text.h"

namespace costate::app {

/// A column of a table: a value a row, null where there is none.
struct StudyColumn {
  std::string group, name;  // where it is in a row; the group may be empty
  std::string heading;      // what stands over it
  std::vector<Json> values;
};

/// The table of these rows, whatever they are runs of.
std::vector<StudyColumn> study_columns(const std::vector<Json>& rows);
/// That of the points of one design: what was varied, psi, outputs, gradients, the optimum.
std::vector<StudyColumn> design_columns(const std::vector<Json>& rows);

/// Of all rows.
std::string study_csv(const Json& rows);
std::string study_table(const std::string& title, const Json& rows);

/// The rows of each design, in order.
std::vector<std::pair<std::string, std::vector<Json>>> rows_by_design(const Json& rows);

/// For each design its name and its table.
std::vector<std::pair<std::string, std::string>> design_csvs(const Json& rows);

/// By design: the sensitivity of those that tell of it (indices.h).
Json study_sensitivity(const Json& rows);

}  // namespace costate::app
