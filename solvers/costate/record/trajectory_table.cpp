#include "costate/record/trajectory_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "costate/base/error.h"

namespace costate {
namespace {

bool is_utf8(const std::string& text) {
  try {
    [[maybe_unused]] const std::string dumped = nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

void require_text(const std::string& text, const std::string& what) {
  const bool control =
      std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
  if (control) throw Error(fmt::format("{} must not contain control characters such as line breaks", what));
  if (!is_utf8(text)) throw Error(fmt::format("{} must be valid UTF-8 text", what));
}

// A name that can be one step of a path such as /coordinates/P1.x in a result file.
void require_path_step(const std::string& text, const std::string& what) {
  if (text.empty()) throw Error(fmt::format("{} must not be empty", what));
  if (text == "." || text == "..") throw Error(fmt::format("{} must not be '{}'", what, text));
  if (text.find('/') != std::string::npos) {
    throw Error(
        fmt::format("{} must not contain '/': it separates group and name in result files; rename it, "
                    "for example '{}'",
                    what, [&] {
                      std::string other = text;
                      std::replace(other.begin(), other.end(), '/', '.');
                      return other;
                    }()));
  }
  require_text(text, what);
}

}  // namespace

void TrajectoryTable::require_consistent() const {
  std::set<std::pair<std::string, std::string>> seen;
  for (const Column& column : columns) {
    const std::string where = fmt::format("trajectory column '{}/{}'", column.group, column.name);
    require_path_step(column.name, fmt::format("{}: the name", where));
    require_path_step(column.group, fmt::format("{}: the group", where));
    require_text(column.unit, fmt::format("{}: the unit", where));
    if (column.group == "time" || column.group == "events" || column.group == "scene" || column.group == "settings") {
      throw Error(fmt::format("{}: the group name '{}' is reserved; use another", where, column.group));
    }
    if (column.values.size() != time_s.size()) {
      throw Error(fmt::format("{} has {} values but there are {} time instants; they must agree", where,
                              column.values.size(), time_s.size()));
    }
    if (!seen.emplace(column.group, column.name).second) {
      throw Error(fmt::format("{} appears more than once; names must be unique within a group", where));
    }
  }
}

const Column* TrajectoryTable::find(const std::string& group, const std::string& name) const {
  for (const Column& column : columns) {
    if (column.name == name && column.group == group) return &column;
  }
  return nullptr;
}

}  // namespace costate
