#include "costate/scene/data_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <sstream>

#include "costate/base/error.h"
#include "costate/base/letters.h"
#include "costate/base/text_file.h"
#include "costate/scene/unit.h"

namespace costate {

namespace {

constexpr std::size_t kLongestData = 256 << 20;  // bytes
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

std::string unquoted(const std::string& text) {
  const std::string bare = trimmed(text);
  return bare.size() >= 2 && bare.front() == '"' && bare.back() == '"' ? unquoted(bare.substr(1, bare.size() - 2))
                                                                       : bare;
}

struct Field {
  std::string text;
  int column;  // from 1
};

/// The fields of a line; blanks in a row are one separator.
std::vector<Field> fields_of(const std::string& line, char separator) {
  std::vector<Field> fields;
  std::size_t at = 0;
  if (separator == ' ') {
    while (at < line.size()) {
      while (at < line.size() && std::isspace(static_cast<unsigned char>(line[at]))) ++at;
      std::size_t end = at;
      char open = 0;  // within brackets or quotes a blank is none
      while (end < line.size() && (open || !std::isspace(static_cast<unsigned char>(line[end])))) {
        if (open && line[end] == open)
          open = 0;
        else if (!open && (line[end] == '[' || line[end] == '('))
          open = line[end] == '[' ? ']' : ')';
        else if (!open && line[end] == '"')
          open = '"';
        ++end;
      }
      if (end > at) fields.push_back({unquoted(line.substr(at, end - at)), static_cast<int>(at) + 1});
      at = end;
    }
    // "angle [deg]" is one name.
    for (std::size_t i = 1; i < fields.size();)
      if (fields[i].text.front() == '[' || fields[i].text.front() == '(') {
        fields[i - 1].text += " " + fields[i].text;
        fields.erase(fields.begin() + static_cast<std::ptrdiff_t>(i));
      } else {
        ++i;
      }
    return fields;
  }
  for (bool more = true; more;) {
    std::size_t end = at;
    for (bool quoted = false; end < line.size() && (quoted || line[end] != separator); ++end)
      if (line[end] == '"') quoted = !quoted;
    fields.push_back({unquoted(line.substr(at, end - at)), static_cast<int>(at) + 1});
    more = end < line.size();
    at = end + 1;
  }
  return fields;
}

char separator_of(const std::string& line, const DataFormat& format) {
  if (!format.separator.empty()) return format.separator[0];
  for (const char c : {';', '\t', ','})
    if (line.find(c) != std::string::npos && !(c == ',' && format.decimal_comma)) return c;
  return ' ';
}

/// A number, or nothing where a value is missing.
bool read_value(std::string text, bool decimal_comma, double& x) {
  if (decimal_comma) std::replace(text.begin(), text.end(), ',', '.');
  const std::string word = in_capitals(text);
  if (word.empty() || word == "NAN" || word == "NA") {
    x = kNothing;
    return true;
  }
  if (text.front() == '+') text.erase(0, 1);
  return read_number(text, x);
}

/// "angle [deg]" or "angle (deg)".
DataColumn column_of(const std::string& header) {
  DataColumn c;
  const std::size_t open = header.find_first_of("[(");
  c.name = unquoted(header.substr(0, open));
  if (open != std::string::npos) {
    const std::size_t close = header.find_last_of("])");
    c.unit = unquoted(header.substr(open + 1, close == std::string::npos ? close : close - open - 1));
  }
  return c;
}

/// The place of the time's column; as many as there are where there is none.
std::size_t time_among(const std::vector<DataColumn>& columns, const DataFormat& format) {
  for (const std::string& wanted :
       format.time.empty() ? std::vector<std::string>{"t", "time", "Time", "TIME", "T"} : std::vector{format.time})
    for (std::size_t i = 0; i < columns.size(); ++i)
      if (columns[i].name == wanted) return i;
  return columns.size();
}

std::string no_number(const std::string& text, bool decimal_comma) {
  return fmt::format("Expected a number, found '{}'.{}", text,
                     text.find(',') != std::string::npos && !decimal_comma
                         ? " If that is a decimal comma, write decimal_comma = true."
                         : "");
}

/// Throws by `fail(column index, message)`.
template <class Fail>
void finish(DataTable& table, const DataFormat& format, const Fail& fail) {
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    DataColumn& c = table.columns[i];
    if (c.name.empty()) fail(i, "A column has no name; name all of them: columns = [\"t [s]\", \"angle [deg]\"].");
    for (std::size_t k = 0; k < i; ++k)
      if (table.columns[k].name == c.name) fail(i, fmt::format("There are two columns '{}'.", c.name));
    const InSi* si = in_si(c.unit);
    if (!si && !c.text.empty()) continue;  // of what is no number
    if (!si) {
      const std::vector<std::string> known = known_units();
      fail(i,
           fmt::format("The unit '{}' of column '{}' is unknown.{} Known here: {}. Columns can be named in the scene, "
                       "too: columns = [\"t [s]\", ...]; without a unit values are taken to be in SI units.",
                       c.unit, c.name, suggestion(c.unit, known), fmt::join(known, ", ")));
    }
    for (double& x : c.values) x *= si->factor;
  }
  std::vector<std::string> names;
  for (const auto& c : table.columns) names.push_back(c.name);
  table.time = format.timed ? time_among(table.columns, format) : names.size();
  if (!format.timed) return;
  if (table.time == names.size())
    fail(names.size(), fmt::format("There is no column '{}' of the time; name it: time = \"...\", or say that there is "
                                   "none: timed = false. The columns are {}.",
                                   format.time.empty() ? "t" : format.time, fmt::join(names, ", ")));
  for (double& t : table.columns[table.time].values) t += format.time_shift_s;
}

/// What is wrong with time t behind those of the table, or nothing.
std::string wrong_time(const std::vector<double>& times) {
  const double t = times.back();
  if (std::isnan(t)) return "The time is missing.";
  if (times.size() > 1 && !(t > times[times.size() - 2]))
    return fmt::format("The times must increase, found {} after {}.", t, times[times.size() - 2]);
  return {};
}

}  // namespace

std::string wrong_unit(const DataColumn& column, const std::string& wanted) {
  const InSi* si = in_si(column.unit);
  // A column with a unit is read in SI units; an output in degrees or millimetres is not.
  const InSi* of_wanted = in_si(wanted);
  if (si && !column.unit.empty() && column.unit != "1" && of_wanted && of_wanted->factor != 1)
    return fmt::format("Column '{}' [{}] is read in {}, and what it is used for is in {}. Give that in {}.",
                       column.name, column.unit, *si->unit ? si->unit : "1", wanted, of_wanted->unit);
  if (!si) return {};
  // Turns a second are no radians a second, and revolutions a minute no events a second.
  const std::optional<UnitExponents> in = unit_exponents(wanted);
  const bool turns = in && *in == UnitExponents{0, 0, -1, 1, 0}, counts = in && *in == UnitExponents{0, 0, -1, 0, 0};
  const bool of_turns = column.unit == "1/min" || column.unit == "rpm";
  if ((turns && column.unit == "Hz") || (counts && of_turns))
    return fmt::format("Column '{}' is in {}, {}, and what it is used for in {}. Give the column in {}.", column.name,
                       column.unit, of_turns ? "revolutions" : "cycles a second", wanted,
                       turns ? "rad/s or rpm" : "Hz");
  // "-" says nothing of a column; a share in percent is a hundredth of something that no force or length is.
  const std::optional<UnitExponents> of = wanted.empty() ? std::nullopt : unit_exponents(wanted);
  const bool share = si->factor != 1 && (!*si->unit || si->unit == std::string("1")) && of && *of != UnitExponents{};
  if (!share && !units_disagree(si->unit, wanted)) return {};
  return fmt::format("Column '{}' is in {} [{}], and what it is used for in {}.", column.name, column.unit, si->unit,
                     wanted);
}

const DataColumn& DataTable::time_column() const {
  if (time < columns.size()) return columns[time];
  throw ModelError("", fmt::format("There is no time in {} (timed = false).", source));
}

const DataColumn& DataTable::column(const std::string& wanted) const {
  std::vector<std::string> names;
  for (const auto& c : columns) {
    if (c.name == wanted && !c.text.empty())
      throw SceneError(c.text_at, fmt::format("{} The scene uses this column, '{}'.", c.text, c.name));
    if (c.name == wanted) return c;
    names.push_back(c.name);
  }
  throw ModelError("", fmt::format("There is no column '{}' in {}.{}", wanted, source, suggestion(wanted, names)));
}

std::shared_ptr<DataTable> read_data_file(const std::string& name, const std::string& file, const DataFormat& format) {
  std::string text = read_text_file(file, kLongestData, "This file of data, whose path is relative to the scene,");
  if (text.rfind("\xEF\xBB\xBF", 0) == 0) text.erase(0, 3);
  std::istringstream in(text);
  auto table = std::make_shared<DataTable>();
  table->name = name;
  table->source = fmt::format("data '{}' ({})", name, std::filesystem::path(file).filename().string());
  for (const std::string& header : format.columns) table->columns.push_back(column_of(header));
  const auto fail = [&](int line, int column, const std::string& what) -> void {
    throw SceneError({file, line, column}, what);
  };
  char separator = 0;
  bool header = false, first = true;
  int header_line = 0;
  std::vector<int> lines;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (!format.comment.empty()) line.resize(std::min(line.size(), line.find(format.comment)));
    if (unquoted(line).empty()) continue;
    if (separator == 0) separator = separator_of(line, format);
    const std::vector<Field> fields = fields_of(line, separator);
    std::vector<double> row(fields.size());
    std::size_t numbers = 0;
    std::vector<std::size_t> wrong;
    for (std::size_t i = 0; i < fields.size(); ++i)
      if (read_value(fields[i].text, format.decimal_comma, row[i]))
        ++numbers;
      else
        wrong.push_back(i);
    // Where the scene has the names the first line may be data, whose time is a number.
    const auto is_wrong = [&](std::size_t i) { return std::find(wrong.begin(), wrong.end(), i) != wrong.end(); };
    const bool words = numbers == 0 || (!wrong.empty() && first &&
                                        (format.columns.empty() || is_wrong(time_among(table->columns, format))));
    if (words && first) {  // names
      first = false;
      header = true;
      header_line = number;
      if (format.columns.empty())
        for (const Field& f : fields) table->columns.push_back(column_of(f.text));
      continue;
    }
    if (first && table->columns.empty())
      fail(number, 1, "The file begins with numbers: name its columns in the scene, columns = [\"t [s]\", ...].");
    first = false;
    if (words && header && lines.empty() && fields.size() == table->columns.size()) {  // units
      header = false;
      if (format.columns.empty())
        for (std::size_t i = 0; i < fields.size(); ++i)
          table->columns[i].unit = column_of("[" + fields[i].text + "]").unit;
      for (std::size_t i = 0; i < fields.size() && format.columns.empty(); ++i)
        if (const std::string& u = table->columns[i].unit; !u.empty() && (u.front() == '[' || u.front() == '('))
          table->columns[i].unit = unquoted(u.substr(1, u.find_last_of("])") - 1));
      continue;
    }
    if (numbers == 0) fail(number, fields.front().column, no_number(fields.front().text, format.decimal_comma));
    if (row.size() != table->columns.size())
      fail(number, 1, fmt::format("Expected {} values, one a column, found {}.", table->columns.size(), row.size()));
    for (const std::size_t i : wrong) {
      const std::string what = no_number(fields[i].text, format.decimal_comma);
      if (format.timed && i == time_among(table->columns, format)) fail(number, fields[i].column, what);
      row[i] = kNothing;
      if (!table->columns[i].text.empty()) continue;
      table->columns[i].text = what;
      table->columns[i].text_at = {file, number, fields[i].column};
    }
    for (std::size_t i = 0; i < row.size(); ++i) table->columns[i].values.push_back(row[i]);
    lines.push_back(number);
  }
  finish(*table, format,
         [&](std::size_t, const std::string& what) { fail(header_line, header_line > 0 ? 1 : 0, what); });
  std::vector<double> times;
  for (std::size_t k = 0; format.timed && k < lines.size(); ++k) {
    times.push_back(table->columns[table->time].values[k]);
    if (const std::string what = wrong_time(times); !what.empty()) fail(lines[k], 1, what);
  }
  if (lines.empty()) fail(0, 0, "This file of data holds no row of numbers.");
  return table;
}

std::shared_ptr<DataTable> make_data_table(const std::string& name, const std::vector<std::vector<double>>& rows,
                                           const DataFormat& format) {
  auto table = std::make_shared<DataTable>();
  const std::string path = "data." + name;
  table->name = name;
  table->source = fmt::format("data '{}'", name);
  for (const std::string& header : format.columns) table->columns.push_back(column_of(header));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].size() != table->columns.size())
      throw ModelError(fmt::format("{}.rows[{}]", path, k), fmt::format("Expected {} values, one a column, found {}.",
                                                                        table->columns.size(), rows[k].size()));
    for (std::size_t i = 0; i < rows[k].size(); ++i) table->columns[i].values.push_back(rows[k][i]);
  }
  if (rows.empty()) throw ModelError(path + ".rows", "holds no row of numbers.");
  finish(*table, format, [&](std::size_t, const std::string& what) { throw ModelError(path + ".columns", what); });
  std::vector<double> times;
  for (std::size_t k = 0; format.timed && k < rows.size(); ++k) {
    times.push_back(table->time_column().values[k]);
    if (const std::string what = wrong_time(times); !what.empty())
      throw ModelError(fmt::format("{}.rows[{}]", path, k), what);
  }
  return table;
}

namespace {
// Laws are read without their builder. A table that is alive belongs to the scene that is being read.
std::map<std::string, std::weak_ptr<const DataTable>>& tables() {
  thread_local std::map<std::string, std::weak_ptr<const DataTable>> of;
  return of;
}
}  // namespace

void add_data_table(MechanismBuilder& builder, std::shared_ptr<const DataTable> table) {
  tables()[table->name] = table;
  builder.add_shared_part("data." + table->name, table);
}

std::shared_ptr<const DataTable> find_data_table(const std::string& name) {
  std::vector<std::string> known;
  for (const auto& [key, table] : tables()) {
    if (table.expired()) continue;
    if (key == name) return table.lock();
    known.push_back(key);
  }
  throw ModelError(
      "", fmt::format("There is no table of data '{}'.{}", name,
                      known.empty() ? " Add one: [data." + name + "] with file = \"...\"." : suggestion(name, known)));
}

}  // namespace costate
