#include "study_hdf5.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <vector>

#include "costate/base/error.h"
#include "costate/record/atomic_file.h"
#include "costate/record/hdf5_memory_file.h"
#include "costate/record/hdf5_write.h"
#include "study_table.h"

namespace costate::app {

namespace {

using record_detail::Hdf5Handle;
using record_detail::make_group;
using record_detail::write_integer_attribute;
using record_detail::write_text_attribute;

constexpr long long kStudyFormatVersion = 1;
constexpr std::size_t kGrowth = 1u << 18;  // bytes, of the file in memory

const std::vector<std::string> kTextColumns = {"name", "status", "error", "stop_reason", "verdict"};

Hdf5Handle write_column(hid_t parent, const StudyColumn& column) {
  std::string name = column.name;
  std::replace(name.begin(), name.end(), '/', '|');
  if (column.group.empty() && std::find(kTextColumns.begin(), kTextColumns.end(), name) != kTextColumns.end()) {
    std::vector<std::string> texts;
    for (const Json& v : column.values) texts.push_back(v.is_string() ? v.get<std::string>() : std::string());
    return record_detail::write_texts(parent, name, texts);
  }
  std::vector<double> numbers;
  for (const Json& v : column.values)
    numbers.push_back(v.is_number()    ? v.get<double>()
                      : v.is_boolean() ? static_cast<double>(v.get<bool>())
                                       : std::numeric_limits<double>::quiet_NaN());
  return record_detail::write_numbers(parent, name, numbers);
}

void write_table(hid_t parent, std::vector<StudyColumn> columns, const std::vector<Json>& rows) {
  StudyColumn errors{"", "error", "", {}};
  for (const Json& r : rows) errors.values.push_back(r.contains("error") ? r["error"] : Json());
  columns.push_back(std::move(errors));
  std::map<std::string, Hdf5Handle> groups;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const StudyColumn& c = columns[i];
    if (!c.group.empty() && !groups.contains(c.group)) groups.emplace(c.group, make_group(parent, c.group));
    const Hdf5Handle set = write_column(c.group.empty() ? parent : groups.at(c.group).get(), c);
    if (c.heading.empty()) continue;
    write_text_attribute(set.get(), "heading", c.heading);
    write_integer_attribute(set.get(), "column", static_cast<long long>(i));
  }
}

void write_tables(hid_t file, const std::string& title, const Json& rows) {
  write_text_attribute(file, "format", "costate-study");
  write_integer_attribute(file, "format_version", kStudyFormatVersion);
  write_text_attribute(file, "title", title);
  const std::vector<Json> all(rows.begin(), rows.end());
  write_table(make_group(file, "runs").get(), study_columns(all), all);
  const Hdf5Handle designs = make_group(file, "designs");
  for (const auto& [design, own] : rows_by_design(rows)) {
    const Hdf5Handle group = make_group(designs.get(), design);
    write_text_attribute(group.get(), "scene", own.front().at("scene").get<std::string>());
    write_text_attribute(group.get(), "task", own.front().at("task").get<std::string>());
    write_table(group.get(), design_columns(own), own);
  }
}

}  // namespace

void write_study_hdf5(const std::filesystem::path& path, const std::string& title, const Json& rows) {
  const record_detail::Hdf5Session session;
  record_detail::Hdf5MemoryFile file(kGrowth);
  std::string_view bytes;
  try {
    write_tables(file.get(), title, rows);
    bytes = file.finish();
  } catch (const Error& error) {
    throw Error(fmt::format("cannot write the HDF5 file '{}': {}", path.string(), error.what()));
  }
  write_file_atomically(path, bytes);
}

}  // namespace costate::app
