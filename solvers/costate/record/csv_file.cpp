#include "costate/record/csv_file.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>

#include "costate/base/error.h"
#include "costate/record/atomic_file.h"
#include "costate/record/posix_file.h"

namespace costate {
namespace {

using record_detail::errno_text;
using record_detail::FileDescriptor;

std::string quoted(const std::string& field) {
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
  std::string result = "\"";
  for (const char c : field) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + '"';
}

std::string label(const std::string& name, const std::string& unit) {
  // A name that itself ends in ']' keeps an empty unit visible, so that the reader cannot mistake it.
  if (unit.empty() && name.back() != ']') return name;
  return fmt::format("{} [{}]", name, unit);
}

void append_number(fmt::memory_buffer& buffer, double value) {
  if (std::isnan(value)) {
    fmt::format_to(std::back_inserter(buffer), "nan");  // fmt would show the sign bit as -nan
  } else {
    fmt::format_to(std::back_inserter(buffer), "{}", value);
  }
}

// Splits one record off `text`, honouring quotes; advances `line` by the line breaks consumed.
std::vector<std::string> next_record(std::string_view& text, long& line) {
  std::vector<std::string> fields(1);
  bool in_quotes = false;
  std::size_t i = 0;
  for (; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') ++line;
    if (in_quotes) {
      if (c != '"') {
        fields.back() += c;
      } else if (i + 1 < text.size() && text[i + 1] == '"') {
        fields.back() += '"';
        ++i;
      } else {
        in_quotes = false;
      }
    } else if (c == '"') {
      in_quotes = true;
    } else if (c == ',') {
      fields.emplace_back();
    } else if (c == '\n') {
      ++i;
      break;
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  text.remove_prefix(i);
  return fields;
}

Column column_from_label(std::string text) {
  Column column;
  const std::size_t bracket = text.rfind(" [");
  if (bracket != std::string::npos && text.back() == ']') {
    column.unit = text.substr(bracket + 2, text.size() - bracket - 3);
    text.resize(bracket);
  }
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) column.group = text.substr(0, slash);
  column.name = slash == std::string::npos ? text : text.substr(slash + 1);
  return column;
}

double parse_number(const std::string& field, const std::filesystem::path& path, long line) {
  double value = 0.0;
  const auto [end, code] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (code != std::errc() || end != field.data() + field.size()) {
    throw Error(fmt::format("'{}' line {}: '{}' is not a number", path.string(), line, field));
  }
  return value;
}

}  // namespace

void write_csv(const std::filesystem::path& path, const TrajectoryTable& table) {
  table.require_consistent();
  write_file_atomically(path, [&](const std::filesystem::path& temporary) {
    FileDescriptor file(::open(temporary.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
    int failed = file.valid() ? 0 : errno;
    fmt::memory_buffer buffer;
    const auto flush = [&] {
      if (failed == 0) failed = record_detail::write_all(file.get(), {buffer.data(), buffer.size()});
      buffer.clear();
    };
    fmt::format_to(std::back_inserter(buffer), "time [s]");
    for (const Column& column : table.columns) {
      fmt::format_to(std::back_inserter(buffer), ",{}", quoted(label(column.group + "/" + column.name, column.unit)));
    }
    buffer.push_back('\n');
    for (std::size_t row = 0; row < table.time_s.size() && failed == 0; ++row) {
      append_number(buffer, table.time_s[row]);
      for (const Column& column : table.columns) {
        buffer.push_back(',');
        append_number(buffer, column.values[row]);
      }
      buffer.push_back('\n');
      if (buffer.size() > (1u << 18)) flush();
    }
    flush();
    if (failed == 0) failed = file.close();
    if (failed != 0) {
      throw Error(fmt::format("cannot write '{}': {}; check the free space and the permissions", path.string(),
                              errno_text(failed)));
    }
  });
}

TrajectoryTable read_csv(const std::filesystem::path& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  std::string content;
  const int failed = file.valid() ? record_detail::read_all(file.get(), content) : errno;
  if (failed != 0) throw Error(fmt::format("cannot read '{}': {}", path.string(), errno_text(failed)));

  std::string_view rest = content;
  long line = 1;
  const std::vector<std::string> header = next_record(rest, line);
  if (header.front() != "time [s]") {
    throw Error(fmt::format("'{}' line 1: the first column must be 'time [s]'; this is not a Costate trajectory",
                            path.string()));
  }
  TrajectoryTable table;
  for (std::size_t i = 1; i < header.size(); ++i) table.columns.push_back(column_from_label(header[i]));
  while (!rest.empty()) {
    const long this_line = line;
    const std::vector<std::string> fields = next_record(rest, line);
    if (fields.size() != header.size()) {
      throw Error(fmt::format("'{}' line {}: {} fields, but the header has {}", path.string(), this_line, fields.size(),
                              header.size()));
    }
    table.time_s.push_back(parse_number(fields[0], path, this_line));
    for (std::size_t i = 1; i < fields.size(); ++i) {
      table.columns[i - 1].values.push_back(parse_number(fields[i], path, this_line));
    }
  }
  try {
    table.require_consistent();
  } catch (const Error& error) {
    throw Error(fmt::format("'{}': {}", path.string(), error.what()));
  }
  return table;
}

}  // namespace costate
