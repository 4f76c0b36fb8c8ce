#include "study_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/base/text_file.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_files.h"
#include "costate/scene/scene_node.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/toml_writer.h"

namespace costate::app {

namespace {

/// Of costate optimize, as a study names them: without dashes in front, and with underscores.
std::vector<std::string> option_keys() {
  std::vector<std::string> keys = {"formulation",
                                   "method",
                                   "integrator",
                                   "cvodes_method",
                                   "sensitivity_corrector",
                                   "rtol",
                                   "atol",
                                   "t_end",
                                   "step",
                                   "algorithm",
                                   "stop_value",
                                   "max_evaluations",
                                   "step_limit_factor",
                                   "checkpoint_steps",
                                   "no_certificate"};
  for (const auto& [key, option] : formulation_options()) {
    if (option.flag.empty()) continue;
    std::string name = option.flag.substr(2);
    std::replace(name.begin(), name.end(), '-', '_');
    keys.push_back(name);
  }
  return keys;
}

constexpr std::size_t kLongestFile = 64 << 20;  // bytes

[[noreturn]] void fail(const SourceLocation& where, const std::string& message) { throw SceneError(where, message); }

void require_known(const SceneNode& table, const std::string& title, const std::vector<std::string>& known) {
  for (const auto& c : table.children)
    if (std::find(known.begin(), known.end(), c.key) == known.end())
      fail(c.key_where, fmt::format("Unknown key '{}' in {}.{}", c.key, title, suggestion(c.key, known)));
}

const SceneNode& require_table(const SceneNode& n, const std::string& title) {
  if (!n.is_table()) fail(n.where, fmt::format("{} must be a table, found {}.", title, n.describe()));
  return n;
}

std::string text_of(const SceneNode& table, const std::string& key, const std::string& title, bool required) {
  const SceneNode* n = table.find(key);
  if (!n && !required) return {};
  if (!n) fail(table.where, fmt::format("{} needs '{}' (a string), which is missing.", title, key));
  if (n->type != SceneNode::Type::text)
    fail(n->where, fmt::format("'{}' in {} must be a string, found {}.", key, title, n->describe()));
  return n->text;
}

/// As in braces and brackets, on one line.
void set_inline(SceneNode& n) {
  n.inlined = n.is_table();
  for (auto& c : n.children) set_inline(c);
}

std::string value_text(SceneNode n) {
  set_inline(n);
  n.key = "x";
  SceneNode root;
  root.children.push_back(std::move(n));
  const std::string text = write_toml(root);  // "x = VALUE\n"
  return text.substr(4, text.size() - 5);
}

/// [set]: dotted keys, quoted or not, and tables below it.
void add_overrides(const SceneNode& table, const std::string& path, std::vector<std::string>& out) {
  for (const auto& c : table.children) {
    const std::string name = path.empty() ? c.key : path + "." + c.key;
    if (c.is_table() && !c.inlined)
      add_overrides(c, name, out);
    else
      out.push_back(name + "=" + value_text(c));
  }
}

void add_options(const SceneNode& table, const std::string& title, std::vector<std::string>& out) {
  require_known(table, title, option_keys());
  for (const auto& c : table.children) {
    std::string option = "--" + c.key;
    std::replace(option.begin() + 2, option.end(), '_', '-');
    if (c.type == SceneNode::Type::flag) {
      if (c.flag) out.push_back(option);
      continue;
    }
    out.push_back(option);
    out.push_back(c.type == SceneNode::Type::text ? c.text : value_text(c));
  }
}

struct Common {
  std::vector<std::string> overrides, options;
};

StudyRun read_run(const SceneNode& table, const Common& common, const std::filesystem::path& directory) {
  StudyRun run;
  run.name = text_of(table, "name", "[[run]]", true);
  const std::string title = fmt::format("the run '{}'", run.name);
  require_known(table, title, {"name", "scene", "parameters", "set", "options"});
  const bool good =
      !run.name.empty() && run.name[0] != '.' && run.name.find_first_of("/\\ \t\r\n\"'") == std::string::npos;
  if (!good)
    fail(table.find("name")->where,
         fmt::format("'{}' cannot be the name of a run: its results get a directory of that name, "
                     "so it must hold no blanks, quotes or slashes.",
                     run.name));
  run.scene = directory / text_of(table, "scene", title, true);
  if (const SceneNode* list = table.find("parameters")) {
    if (!list->is_array())
      fail(list->where, fmt::format("'parameters' in {} must be an array, found {}.", title, list->describe()));
    for (const auto& p : list->children) {
      if (p.type != SceneNode::Type::text)
        fail(p.where, fmt::format("'parameters' in {} must hold strings, found {}.", title, p.describe()));
      run.parameters.push_back(p.text);
    }
  }
  run.overrides = common.overrides;
  run.options = common.options;
  if (const SceneNode* set = table.find("set"))
    add_overrides(require_table(*set, "'set' in " + title), "", run.overrides);
  if (const SceneNode* o = table.find("options"))
    add_options(require_table(*o, "'options' in " + title), "[options] of " + title, run.options);
  try {
    const SceneFileLog log(run.scene.string());
    const Scene scene = Scene::load(run.scene.string(), run.overrides);
    scene.mechanism()->select(run.parameters);
    if (scene.objective().running.empty() && scene.objective().terminal.empty())
      throw Error("Its scene has no cost to minimise.");
    run.scene_text = scene.dump();
    run.files = log.files();
  } catch (const Error& e) {
    fail(table.where, fmt::format("The run '{}': {}", run.name, e.what()));
  }
  return run;
}

}  // namespace

Study read_study(const std::string& path, const std::vector<std::string>& selected) {
  const SceneNode root = read_toml(read_text_file(path, kLongestFile, "The study"), path);
  require_known(root, "the study", {"title", "set", "options", "run"});
  Study study;
  study.title = text_of(root, "title", "the study", false);
  Common common;
  if (const SceneNode* set = root.find("set")) add_overrides(require_table(*set, "'set'"), "", common.overrides);
  if (const SceneNode* o = root.find("options"))
    add_options(require_table(*o, "'options'"), "[options]", common.options);
  const SceneNode* runs = root.find("run");
  if (!runs || !runs->is_table_array())
    fail(runs ? runs->where : SourceLocation{path, 0, 0}, "A study lists its runs, each with the header [[run]].");
  std::vector<std::string> names;
  for (const auto& table : runs->children) {
    const std::string name = text_of(table, "name", "[[run]]", true);
    if (std::find(names.begin(), names.end(), name) != names.end())
      fail(table.where, fmt::format("There are two runs named '{}'.", name));
    names.push_back(name);
  }
  for (const auto& pattern : selected)
    if (std::none_of(names.begin(), names.end(),
                     [&](const auto& n) { return ::fnmatch(pattern.c_str(), n.c_str(), 0) == 0; }))
      throw Error(fmt::format("--only: There is no run '{}'.{}", pattern, suggestion(pattern, names)));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool wanted = selected.empty() || std::any_of(selected.begin(), selected.end(), [&](const auto& pattern) {
                          return ::fnmatch(pattern.c_str(), names[i].c_str(), 0) == 0;
                        });
    if (wanted) study.runs.push_back(read_run(runs->children[i], common, std::filesystem::path(path).parent_path()));
  }
  return study;
}

}  // namespace costate::app
