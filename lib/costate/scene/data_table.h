// Measured data that a scene names, [data.NAME]: columns with names and units, of a text file or written in the scene.
// Values are in SI units from here on. Laws and costs copy what they take; the table itself lives while its scene is
// read.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/element/shared_part.h"
#include "costate/mechanism/builder.h"

namespace costate {

struct DataColumn {
  std::string name, unit;      // the unit as it is written: "deg"
  std::vector<double> values;  // in SI units; NaN where a value is missing
  std::string text = {};       // the first that is no number, and where: such a column can be there, not be used
  SourceLocation text_at = {};
};

struct DataTable final : SharedPart {
  std::string name, source;  // "run7"; for messages: "data 'run7' (run7.csv)"
  std::vector<DataColumn> columns;
  std::size_t time = 0;  // the column of the time [s], which increases from row to row; of no time their number

  /// Throws ModelError in a table of no time.
  const DataColumn& time_column() const;
  /// Throws ModelError with near names, SceneError at a text in the column.
  const DataColumn& column(const std::string& wanted) const;
};

struct DataFormat {
  std::string separator = {};  // one character; empty: that of the first line
  std::string comment = "#";   // what follows it on a line is left out
  bool decimal_comma = false;
  /// Names, with units in brackets ("angle [deg]"), in the place of those of the file's first line.
  std::vector<std::string> columns = {};
  std::string time = {};    // name of the time's column; empty: t or time
  double time_shift_s = 0;  // is added to the times
  bool timed = true;        // false: rows in any order, of no time
};

/// Empty, or what is wrong where a column with a unit of its own stands for something in the SI unit `wanted` of
/// another kind (a mass for an angle).
std::string wrong_unit(const DataColumn& column, const std::string& wanted);

/// Reads a file. Throws SceneError at file:line:column.
std::shared_ptr<DataTable> read_data_file(const std::string& name, const std::string& file, const DataFormat& format);
/// The same of rows of numbers; throws ModelError.
std::shared_ptr<DataTable> make_data_table(const std::string& name, const std::vector<std::vector<double>>& rows,
                                           const DataFormat& format);

void add_data_table(MechanismBuilder& builder, std::shared_ptr<const DataTable> table);
/// The table of the scene that this thread reads; throws ModelError with near names.
std::shared_ptr<const DataTable> find_data_table(const std::string& name);

}  // namespace costate
