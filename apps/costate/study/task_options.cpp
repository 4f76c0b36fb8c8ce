#include "task_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "costate/command_line.h"
#include "costate/scene/toml_writer.h"
#include "study_keys.h"

namespace costate::app {

namespace {

/// What a study says of a run elsewhere, or gives it itself; a branch of cycles or a fit of several scenes is no run
/// of one.
const std::vector<std::string> kNotInStudies = {"help",    "set",      "parameters", "output",   "json",       "quiet",
                                                "verbose", "no_files", "resume",     "continue", "max_points", "with"};

const std::vector<std::string>& options_of_task(const std::string& task) {
  static std::map<std::string, std::vector<std::string>> known;
  const auto [at, added] = known.try_emplace(task);
  if (!added) return at->second;
  for (std::string name : CommandLine().option_names(task)) {
    std::replace(name.begin(), name.end(), '-', '_');
    if (std::find(kNotInStudies.begin(), kNotInStudies.end(), name) == kNotInStudies.end()) at->second.push_back(name);
  }
  return at->second;
}

std::string option_value(const SceneNode& n) {
  if (n.type == SceneNode::Type::text) return n.text;
  if (!n.is_array()) return toml_value(n);
  std::vector<std::string> parts;
  for (const auto& c : n.children) parts.push_back(option_value(c));
  return fmt::format("{}", fmt::join(parts, ","));
}

/// A value of the wrong kind is told here, not by each run.
void require_readable(const SceneNode& n, const std::string& task, const std::vector<std::string>& words) {
  std::vector<std::string> line = {task, "scene.toml"};
  line.insert(line.end(), words.begin(), words.end());
  try {
    CommandLine().parse(line);
  } catch (const UsageError& e) {
    study_keys::fail(n.where, fmt::format("'{}' of costate {}: {}", n.key, task, e.what()));
  }
}

}  // namespace

const std::vector<std::string>& study_tasks() {
  static const std::vector<std::string> tasks = {"optimize", "simulate", "gradient", "fit", "cycle"};
  return tasks;
}

bool task_takes(const std::string& task, const std::string& option) {
  const auto& names = options_of_task(task);
  return std::find(names.begin(), names.end(), option) != names.end();
}

void add_options(const SceneNode& table, const std::string& title, const std::string& task,
                 const std::vector<std::string>& tasks, std::vector<std::string>& out) {
  std::vector<std::string> known;
  for (const std::string& t : tasks)
    for (const std::string& name : options_of_task(t))
      if (std::find(known.begin(), known.end(), name) == known.end()) known.push_back(name);
  study_keys::require_known(table, fmt::format("{} (of costate {})", title, fmt::join(tasks, ", ")), known);
  for (const auto& c : table.children) {
    if (!task_takes(task, c.key)) continue;
    std::string option = "--" + c.key;
    std::replace(option.begin() + 2, option.end(), '_', '-');
    std::vector<std::string> words;
    if (c.type != SceneNode::Type::flag)
      words = {option, option_value(c)};
    else if (c.flag)
      words = {option};
    require_readable(c, task, words);
    out.insert(out.end(), words.begin(), words.end());
  }
}

}  // namespace costate::app
