#include "study_hdf5.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "costate/base/error.h"
#include "costate/record/atomic_file.h"
#include "costate/record/hdf5_handle.h"
#include "costate/record/hdf5_memory_file.h"
#include "study_table.h"

namespace costate::app {

namespace {

using record_detail::check_hdf5;
using record_detail::Hdf5Handle;
using record_detail::Hdf5MemoryFile;

constexpr long long kStudyFormatVersion = 1;
constexpr std::size_t kGrowth = 1u << 18;  // bytes, of the file in memory

const std::vector<std::string> kTextColumns = {"name", "status", "error", "stop_reason", "verdict"};

Hdf5Handle text_type() {
  Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "creating the text type");
  check_hdf5(H5Tset_size(type.get(), H5T_VARIABLE), "creating the text type");
  check_hdf5(H5Tset_cset(type.get(), H5T_CSET_UTF8), "creating the text type");
  return type;
}

void write_attribute(hid_t object, const char* name, hid_t type, hid_t memory, const void* value) {
  const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose, "creating a dataspace");
  const Hdf5Handle attribute(H5Acreate2(object, name, type, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                             "creating an attribute");
  check_hdf5(H5Awrite(attribute.get(), memory, value), "writing an attribute");
}

void write_attribute(hid_t object, const char* name, const std::string& text) {
  const Hdf5Handle type = text_type();
  const char* pointer = text.c_str();
  write_attribute(object, name, type.get(), type.get(), &pointer);
}

void write_attribute(hid_t object, const char* name, long long value) {
  write_attribute(object, name, H5T_STD_I64LE, H5T_NATIVE_LLONG, &value);
}

/// UTF-8, and no time stamps.
struct Creation {
  Hdf5Handle links, groups, datasets;
  Creation()
      : links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, "creating link properties"),
        groups(H5Pcreate(H5P_GROUP_CREATE), H5Pclose, "creating object properties"),
        datasets(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "creating object properties") {
    check_hdf5(H5Pset_char_encoding(links.get(), H5T_CSET_UTF8), "creating link properties");
    check_hdf5(H5Pset_obj_track_times(groups.get(), false), "creating object properties");
    check_hdf5(H5Pset_obj_track_times(datasets.get(), false), "creating object properties");
  }

  Hdf5Handle group(hid_t parent, const std::string& name) const {
    return {H5Gcreate2(parent, name.c_str(), links.get(), groups.get(), H5P_DEFAULT), H5Gclose, "creating a group"};
  }
  Hdf5Handle dataset(hid_t parent, std::string name, hid_t type, hid_t memory, hsize_t rows, const void* data) const {
    std::replace(name.begin(), name.end(), '/', '|');
    const Hdf5Handle space(H5Screate_simple(1, &rows, nullptr), H5Sclose, "creating a dataspace");
    Hdf5Handle set(H5Dcreate2(parent, name.c_str(), type, space.get(), links.get(), datasets.get(), H5P_DEFAULT),
                   H5Dclose, "creating a dataset");
    check_hdf5(H5Dwrite(set.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), "writing a dataset");
    return set;
  }
};

Hdf5Handle write_column(const Creation& make, hid_t parent, const StudyColumn& column) {
  const hsize_t rows = column.values.size();
  const bool text =
      column.group.empty() && std::find(kTextColumns.begin(), kTextColumns.end(), column.name) != kTextColumns.end();
  if (text) {
    std::vector<std::string> texts;
    for (const Json& v : column.values) texts.push_back(v.is_string() ? v.get<std::string>() : std::string());
    std::vector<const char*> pointers;
    for (const auto& t : texts) pointers.push_back(t.c_str());
    const Hdf5Handle type = text_type();
    return make.dataset(parent, column.name, type.get(), type.get(), rows, pointers.data());
  }
  std::vector<double> numbers;
  for (const Json& v : column.values)
    numbers.push_back(v.is_number()    ? v.get<double>()
                      : v.is_boolean() ? static_cast<double>(v.get<bool>())
                                       : std::numeric_limits<double>::quiet_NaN());
  return make.dataset(parent, column.name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, rows, numbers.data());
}

void write_table(const Creation& make, hid_t parent, std::vector<StudyColumn> columns, const std::vector<Json>& rows) {
  StudyColumn errors{"", "error", "", {}};
  for (const Json& r : rows) errors.values.push_back(r.contains("error") ? r["error"] : Json());
  columns.push_back(std::move(errors));
  std::map<std::string, Hdf5Handle> groups;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const StudyColumn& c = columns[i];
    if (!c.group.empty() && !groups.contains(c.group)) groups.emplace(c.group, make.group(parent, c.group));
    const Hdf5Handle set = write_column(make, c.group.empty() ? parent : groups.at(c.group).get(), c);
    if (c.heading.empty()) continue;
    write_attribute(set.get(), "heading", c.heading);
    write_attribute(set.get(), "column", static_cast<long long>(i));
  }
}

void write_tables(hid_t file, const std::string& title, const Json& rows) {
  const Creation make;
  write_attribute(file, "format", "costate-study");
  write_attribute(file, "format_version", kStudyFormatVersion);
  write_attribute(file, "title", title);
  const std::vector<Json> all(rows.begin(), rows.end());
  write_table(make, make.group(file, "runs").get(), study_columns(all), all);
  const Hdf5Handle designs = make.group(file, "designs");
  for (const auto& [design, own] : rows_by_design(rows)) {
    const Hdf5Handle group = make.group(designs.get(), design);
    write_attribute(group.get(), "scene", own.front().at("scene").get<std::string>());
    write_attribute(group.get(), "task", own.front().at("task").get<std::string>());
    write_table(make, group.get(), design_columns(own), own);
  }
}

}  // namespace

void write_study_hdf5(const std::filesystem::path& path, const std::string& title, const Json& rows) {
  const record_detail::Hdf5Session session;
  Hdf5MemoryFile file(kGrowth);
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
