#include "costate/record/hdf5_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/stop.h"
#include "costate/record/atomic_file.h"
#include "costate/record/hdf5_handle.h"
#include "costate/record/hdf5_memory_file.h"
#include "costate/record/hdf5_write.h"
#include "costate/record/json_number.h"

namespace costate {
namespace {

namespace fs = std::filesystem;
using record_detail::check_hdf5;
using record_detail::Hdf5ColumnWriter;
using record_detail::Hdf5Handle;
using record_detail::Hdf5MemoryFile;
using record_detail::Hdf5Session;
using record_detail::make_group;
using record_detail::write_integer_attribute;
using record_detail::write_numbers;
using record_detail::write_text;
using record_detail::write_text_attribute;
using record_detail::write_texts;

constexpr const char* kFormat = "costate-trajectory";
constexpr int kFormatVersion = 1;

// ---------------------------------------------------------------------------------------------- writing

void write_events(hid_t file, const std::vector<TableEvent>& events) {
  const Hdf5Handle group = make_group(file, "events");
  std::vector<double> times, jumps;
  std::vector<std::string> names, modes;
  for (const TableEvent& e : events) {
    times.push_back(e.t);
    jumps.push_back(e.jump);
    names.push_back(e.name);
    modes.push_back(e.mode);
  }
  write_text_attribute(write_numbers(group.get(), "time", times).get(), "unit", "s");
  write_numbers(group.get(), "jump", jumps);
  write_texts(group.get(), "name", names);
  write_texts(group.get(), "mode", modes);
}

void write_content(const Hdf5MemoryFile& file, const TrajectoryTable& table) {
  write_text_attribute(file.get(), "format", kFormat);
  write_integer_attribute(file.get(), "format_version", kFormatVersion);
  write_text(file.get(), "scene", table.scene_text);
  write_text(file.get(), "settings", json_to_line(table.settings, "the settings"));
  write_text_attribute(write_numbers(file.get(), "time", table.time_s).get(), "unit", "s");
  if (!table.events.empty()) write_events(file.get(), table.events);

  const Hdf5ColumnWriter writer(table.time_s.size());
  std::map<std::string, Hdf5Handle> groups;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    check_stop();
    const Column& column = table.columns[i];
    auto group = groups.find(column.group);
    if (group == groups.end()) group = groups.emplace(column.group, make_group(file.get(), column.group)).first;
    writer.write(group->second.get(), column.name, column.values, column.unit, static_cast<long long>(i));
  }
}

// ---------------------------------------------------------------------------------------------- reading

// Reads a scalar text of either kind (variable or fixed length) with `read(memory type, buffer)`.
template <class Read>
std::string read_text(const Hdf5Handle& type, Read read) {
  if (H5Tget_class(type.get()) != H5T_STRING) throw Error("expected text");
  if (H5Tis_variable_str(type.get()) > 0) {
    char* pointer = nullptr;
    check_hdf5(read(type.get(), &pointer), "reading text");
    std::string text = pointer == nullptr ? "" : pointer;
    if (pointer != nullptr) H5free_memory(pointer);
    return text;
  }
  std::string text(H5Tget_size(type.get()), '\0');
  check_hdf5(read(type.get(), text.data()), "reading text");
  return text.substr(0, text.find('\0'));
}

void require_scalar(const Hdf5Handle& space) {
  if (H5Sget_simple_extent_npoints(space.get()) != 1) throw Error("expected a single value");
}

std::string read_text_attribute(hid_t object, const char* name) {
  const Hdf5Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose, "opening an attribute");
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose, "reading an attribute");
  require_scalar({H5Aget_space(attribute.get()), H5Sclose, "reading an attribute"});
  return read_text(type, [&](hid_t memory, void* data) { return H5Aread(attribute.get(), memory, data); });
}

long long read_integer_attribute(hid_t object, const char* name, long long fallback) {
  if (H5Aexists(object, name) <= 0) return fallback;
  const Hdf5Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose, "opening an attribute");
  require_scalar({H5Aget_space(attribute.get()), H5Sclose, "reading an attribute"});
  long long value = 0;
  check_hdf5(H5Aread(attribute.get(), H5T_NATIVE_LLONG, &value), "reading an attribute");
  return value;
}

std::string read_text_dataset(hid_t file, const char* name) {
  const Hdf5Handle dataset(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose, "opening a text dataset");
  const Hdf5Handle type(H5Dget_type(dataset.get()), H5Tclose, "reading text");
  require_scalar({H5Dget_space(dataset.get()), H5Sclose, "reading text"});
  return read_text(type, [&](hid_t memory, void* data) {
    return H5Dread(dataset.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
  });
}

std::vector<double> read_numbers(hid_t dataset) {
  const Hdf5Handle space(H5Dget_space(dataset), H5Sclose, "reading a dataset");
  hsize_t rows = 0;
  if (H5Sget_simple_extent_ndims(space.get()) != 1) throw Error("expected a one-dimensional dataset");
  check_hdf5(H5Sget_simple_extent_dims(space.get(), &rows, nullptr), "reading a dataset");
  // A damaged length must not become a huge allocation; deflate shrinks by a factor of at most about 1032.
  if (rows > H5Dget_storage_size(dataset) / sizeof(double) * 1100) throw Error("a dataset has a damaged length");
  std::vector<double> values(rows);
  check_hdf5(H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), "reading a dataset");
  return values;
}

herr_t collect_name(hid_t, const char* name, const H5L_info_t*, void* data) {
  static_cast<std::vector<std::string>*>(data)->emplace_back(name);
  return 0;
}

std::vector<std::string> link_list(hid_t group) {
  std::vector<std::string> names;
  check_hdf5(H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_name, &names), "listing a group");
  return names;
}

std::vector<std::string> read_texts(hid_t parent, const char* name, std::size_t rows) {
  const Hdf5Handle dataset(H5Dopen2(parent, name, H5P_DEFAULT), H5Dclose, "opening a text dataset");
  const Hdf5Handle type = record_detail::hdf5_text_type(), space(H5Dget_space(dataset.get()), H5Sclose, "reading text");
  if (H5Sget_simple_extent_npoints(space.get()) != static_cast<hssize_t>(rows))
    throw Error("the lists of events differ in length");
  std::vector<char*> pointers(rows, nullptr);
  check_hdf5(H5Dread(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers.data()), "reading text");
  std::vector<std::string> texts;
  for (char* p : pointers) {
    texts.emplace_back(p == nullptr ? "" : p);
    if (p != nullptr) H5free_memory(p);
  }
  return texts;
}

std::vector<TableEvent> read_events(hid_t group) {
  const auto numbers = [&](const char* name) {
    const Hdf5Handle dataset(H5Dopen2(group, name, H5P_DEFAULT), H5Dclose, "opening a dataset");
    return read_numbers(dataset.get());
  };
  const std::vector<double> times = numbers("time"), jumps = numbers("jump");
  const std::vector<std::string> names = read_texts(group, "name", times.size()),
                                 modes = read_texts(group, "mode", times.size());
  if (jumps.size() != times.size()) throw Error("the lists of events differ in length");
  std::vector<TableEvent> events;
  for (std::size_t i = 0; i < times.size(); ++i) events.push_back({times[i], names[i], modes[i], jumps[i]});
  return events;
}

TrajectoryTable read_content(const fs::path& path) {
  const Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, "opening the file");
  if (H5Aexists(file.get(), "format") <= 0 || read_text_attribute(file.get(), "format") != kFormat) {
    throw Error(fmt::format("it is HDF5, but not a Costate trajectory (attribute format is not \"{}\")", kFormat));
  }
  const long long version = read_integer_attribute(file.get(), "format_version", 0);
  if (version != kFormatVersion) {
    throw Error(
        fmt::format("its format_version is {}, this program reads {}; use the version of Costate that "
                    "wrote the file, or a newer one",
                    version, kFormatVersion));
  }
  TrajectoryTable table;
  table.scene_text = read_text_dataset(file.get(), "scene");
  try {
    table.settings = nlohmann::json::parse(read_text_dataset(file.get(), "settings"));
  } catch (const nlohmann::json::exception& error) {
    throw Error(fmt::format("/settings is not valid JSON: {}", error.what()));
  }
  const Hdf5Handle time(H5Dopen2(file.get(), "time", H5P_DEFAULT), H5Dclose, "opening /time");
  table.time_s = read_numbers(time.get());

  std::vector<std::pair<long long, Column>> columns;
  for (const std::string& group_name : link_list(file.get())) {
    const Hdf5Handle group(H5Oopen(file.get(), group_name.c_str(), H5P_DEFAULT), H5Oclose, "opening a group");
    if (H5Iget_type(group.get()) != H5I_GROUP) continue;
    if (group_name == "events") {
      table.events = read_events(group.get());
      continue;
    }
    for (const std::string& name : link_list(group.get())) {
      const Hdf5Handle dataset(H5Dopen2(group.get(), name.c_str(), H5P_DEFAULT), H5Dclose, "opening a dataset");
      Column column{name, read_text_attribute(dataset.get(), "unit"), group_name, read_numbers(dataset.get())};
      const long long position = read_integer_attribute(dataset.get(), "column", std::numeric_limits<long long>::max());
      columns.emplace_back(position, std::move(column));
    }
  }
  std::stable_sort(columns.begin(), columns.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& [position, column] : columns) table.columns.push_back(std::move(column));
  table.require_consistent();
  return table;
}

}  // namespace

void write_hdf5(const fs::path& path, const TrajectoryTable& table) {
  table.require_consistent();
  const Hdf5Session session;
  const std::size_t table_bytes = (table.columns.size() + 1) * table.time_s.size() * sizeof(double);
  Hdf5MemoryFile file(std::clamp<std::size_t>(table_bytes / 8, 1u << 16, 1u << 26));
  std::string_view bytes;
  try {
    write_content(file, table);
    bytes = file.finish();
  } catch (const Error& error) {
    throw Error(fmt::format("cannot write the HDF5 file '{}': {}", path.string(), error.what()));
  }
  write_file_atomically(path, bytes);
}

TrajectoryTable read_hdf5(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code)) {
    throw Error(fmt::format("cannot read '{}': {}", path.string(),
                            code ? code.message() : "there is no such file; check the path"));
  }
  const Hdf5Session session;
  if (H5Fis_hdf5(path.c_str()) == 0) {
    throw Error(
        fmt::format("cannot read '{}': it is not an HDF5 file; give a trajectory written by Costate", path.string()));
  }
  try {
    return read_content(path);
  } catch (const std::exception& error) {
    throw Error(fmt::format("cannot read the HDF5 file '{}': {}", path.string(), error.what()));
  }
}

}  // namespace costate
