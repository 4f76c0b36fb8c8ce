// The trajectory table: what one simulation leaves on disk. A time grid, named columns with units (sorted
// into groups), and what is needed to run it again: the scene text and the settings. The table is plain
// data; write_hdf5 and write_csv store it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace costate {

/// One recorded scalar signal.
struct Column {
  std::string name;            ///< e.g. "P1.x"; dots are welcome, '/' is not allowed
  std::string unit;            ///< e.g. "m", "m/s", "N"; empty or "1" for a pure number
  std::string group;           ///< coordinates, velocities, accelerations, multipliers, states, outputs
  std::vector<double> values;  ///< one value per time instant, in `unit`
};

/// What happened at an instant between samples: a contact that touched.
struct TableEvent {
  double t = 0;      ///< s
  std::string name;  ///< "contact.foot: touch"
  std::string mode;  ///< behind it: "closed"
  double jump = 0;   ///< of the state that jumped most, in its own unit

  bool operator==(const TableEvent&) const = default;
};

/// A recorded simulation: n time instants and any number of columns of length n.
struct TrajectoryTable {
  std::vector<double> time_s;  ///< time instants in s, length n
  std::vector<Column> columns;
  std::vector<TableEvent> events;  ///< in order of time
  std::string scene_text;          ///< the full TOML of the scene as it was run
  nlohmann::json settings;         ///< the settings of the run (method, tolerances, ...)

  /// Checks that the table can be stored: every column as long as the time grid; every group/name unique;
  /// names and groups not empty, not "." or "..", valid UTF-8 and without '/' or control characters; no
  /// group called time, events, scene or settings. Throws Error naming the offending column.
  void require_consistent() const;

  /// The column with this group and name, or nullptr.
  [[nodiscard]] const Column* find(const std::string& group, const std::string& name) const;
};

}  // namespace costate
