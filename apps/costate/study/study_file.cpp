#include "study_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/text_file.h"
#include "costate/design/design.h"
#include "costate/objective/output.h"
#include "costate/objective/sampled_cost.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_files.h"
#include "costate/scene/scene_node.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/toml_writer.h"
#include "study_keys.h"
#include "task_options.h"

namespace costate::app {

namespace {

constexpr std::size_t kLongestFile = 64 << 20;  // bytes

using study_keys::count_of;
using study_keys::fail;
using study_keys::kMostPoints;
using study_keys::number_of;
using study_keys::require_known;
using study_keys::require_table;
using study_keys::text_of;
using study_keys::texts_of;
using study_keys::word_of;

struct Common {
  std::vector<std::string> overrides;
  std::vector<std::string> last;       // overrides behind those of the runs
  const SceneNode* options = nullptr;  // or null
  std::vector<std::string> tasks;      // that the study has
};

/// Scene, parameters, overrides and options of a run, or of all runs of a design.
void read_scene_of(StudyRun& run, const SceneNode& table, const std::string& title, const Common& common,
                   const std::filesystem::path& directory) {
  const bool good =
      !run.name.empty() && run.name[0] != '.' && run.name.find_first_of("/\\ \t\r\n\"'") == std::string::npos;
  if (!good)
    fail(table.find("name")->where,
         fmt::format("'{}' cannot be the name of a run: its results get a directory of that name, "
                     "so it must hold no blanks, quotes or slashes.",
                     run.name));
  run.scene = directory / text_of(table, "scene", title, true);
  run.parameters = texts_of(table, "parameters", title);
  run.overrides = common.overrides;
  if (common.options != nullptr)
    add_options(require_table(*common.options, "'options'"), "[options]", run.task, common.tasks, run.options);
  if (const SceneNode* set = table.find("set"))
    add_overrides(require_table(*set, "'set' in " + title), "", run.overrides);
  run.overrides.insert(run.overrides.end(), common.last.begin(), common.last.end());
  if (const SceneNode* o = table.find("options"))
    add_options(require_table(*o, "'options' in " + title), "[options] of " + title, run.task, {run.task}, run.options);
}

void load_scene_of(StudyRun& run, const SceneNode& table) {
  try {
    const SceneFileLog log(run.scene.string());
    const Scene scene = Scene::load(run.scene.string(), run.overrides);
    scene.mechanism()->select(run.parameters);
    for (const std::string& name : run.outputs) make_output(*scene.mechanism(), name);
    const Objective objective = scene.cases.empty() ? scene.objective() : Objective();
    run.costs = !scene.cases.empty() || !objective.running.empty() || !objective.terminal.empty();
    if (run.task == "optimize" && !run.costs) throw Error("Its scene has no cost to minimise.");
    if (run.task == "fit" && !has_samples(objective))
      throw Error("There is nothing to fit: give the scene [[cost.samples]] with measured data.");
    const auto given = [&](const char* option) {
      return std::find(run.options.begin(), run.options.end(), option) != run.options.end();
    };
    if (run.task == "cycle" && !scene.cycle && !given("--section") && !given("--period"))
      throw Error("Its scene has no [cycle], and the options neither 'section' nor 'period'.");
    for (const std::string& quantity : run.pareto) {
      std::vector<std::string> known = {"psi"};
      for (const SceneCase& c : scene.cases) known.push_back(c.name);
      known.insert(known.end(), run.outputs.begin(), run.outputs.end());
      if (run.task == "cycle") known.insert(known.end(), {"period_s", "multiplier", "speed_m_per_s"});
      if (std::find(known.begin(), known.end(), quantity) == known.end())
        throw Error(
            fmt::format("'pareto' names '{}', which is not psi, an output of 'outputs', a case of the scene or what a "
                        "cycle has.{}",
                        quantity, suggestion(quantity, known)));
    }
    run.scene_text = scene.dump();
    run.files = log.files();
    take_notices();  // the run tells them itself
  } catch (const Error& e) {
    fail(table.where, fmt::format("The run '{}': {}", run.name, e.what()));
  }
}

StudyRun read_run(const SceneNode& table, const Common& common, const std::filesystem::path& directory) {
  StudyRun run;
  run.name = text_of(table, "name", "[[run]]", true);
  const std::string title = fmt::format("the run '{}'", run.name);
  require_known(table, title, {"name", "scene", "task", "parameters", "set", "options"});
  run.task = word_of(table, "task", title, study_tasks(), false);
  read_scene_of(run, table, title, common, directory);
  load_scene_of(run, table);
  return run;
}

/// One entry of [design.vary].
Variation read_variation(const SceneNode& n, const std::string& path, bool grid) {
  const std::string title = fmt::format("the variation of '{}'", path);
  require_table(n, title);
  Variation v;
  v.path = path;
  if (n.find("mean") != nullptr) {
    require_known(n, title, {"mean", "sigma"});
    if (grid) fail(n.where, title + " is a distribution, of which there is no grid: give 'from', 'to' and 'steps'.");
    v.kind = Variation::Kind::normal;
    v.first = number_of(n, "mean", title);
    v.second = number_of(n, "sigma", title);
    if (!(v.second > 0)) fail(n.find("sigma")->where, fmt::format("'sigma' in {} must be positive.", title));
    return v;
  }
  require_known(n, title,
                grid ? std::vector<std::string>{"from", "to", "steps", "scale"}
                     : std::vector<std::string>{"from", "to", "scale", "mean", "sigma"});
  v.first = number_of(n, "from", title);
  v.second = number_of(n, "to", title);
  if (grid) v.steps = count_of(n, "steps", title, 1);
  const std::string scale = text_of(n, "scale", title, false);
  if (scale == "log") {
    v.kind = Variation::Kind::logarithmic;
    if (!(v.first * v.second > 0))
      fail(n.where, fmt::format("{} is logarithmic, so that 'from' and 'to' have one sign and are not zero.", title));
  } else if (!scale.empty() && scale != "linear") {
    fail(n.find("scale")->where, fmt::format("'scale' in {} must be \"linear\" or \"log\", found '{}'.", title, scale));
  }
  return v;
}

void add_variations(const SceneNode& table, const std::string& path, bool grid, std::vector<Variation>& out) {
  for (const auto& c : table.children) {
    const std::string name = path.empty() ? c.key : path + "." + c.key;
    if (c.is_table() && !c.inlined && c.find("from") == nullptr && c.find("mean") == nullptr)
      add_variations(c, name, grid, out);
    else
      out.push_back(read_variation(c, name, grid));
  }
}

/// The numbers, with factors, that each variation sets: of a parameter all of its own.
std::vector<std::vector<std::pair<std::string, double>>> numbers_of(const StudyRun& run,
                                                                    const std::vector<Variation>& variations) {
  const Scene scene = Scene::load(run.scene.string(), run.overrides);
  take_notices();
  const auto& mechanism = *scene.mechanism();
  std::vector<std::vector<std::pair<std::string, double>>> numbers;
  for (const Variation& v : variations) {
    numbers.push_back({{v.path, 1.0}});
    for (const Parameter& p : mechanism.parameters()) {
      if (p.name != v.path) continue;
      numbers.back().clear();
      for (const auto& [index, factor] : p.bindings)
        numbers.back().emplace_back(mechanism.numbers()[static_cast<std::size_t>(index)].path, factor);
    }
  }
  return numbers;
}

/// The parameters of a gradient that are the numbers varied, one for one; none where one of these is missing.
std::vector<std::string> parameters_of(const StudyRun& run, const std::vector<Variation>& variations) {
  const Scene scene = Scene::load(run.scene.string(), run.overrides);
  take_notices();
  const auto& mechanism = *scene.mechanism();
  const ParameterSelection selection = mechanism.select(run.parameters);
  std::vector<std::string> names;
  for (const Variation& v : variations)
    for (const Parameter& p : selection.parameters)
      if (p.name == v.path || (p.bindings.size() == 1 && p.bindings[0].second == 1 &&
                               mechanism.numbers()[static_cast<std::size_t>(p.bindings[0].first)].path == v.path)) {
        names.push_back(p.name);
        break;
      }
  return names.size() == variations.size() ? names : std::vector<std::string>();
}

/// What a scene says is the same at all points: of one that cannot be run its own run tells, of all the first one here.
StudyRun first_that_loads(const std::vector<StudyRun>& runs, const SceneNode& table) {
  // Some of them: where none can be run the mistake is of all.
  constexpr std::size_t most = 32;
  std::exception_ptr of_first;
  for (std::size_t i = 0; i < runs.size(); i += 1 + runs.size() / most) try {
      StudyRun run = runs[i];
      load_scene_of(run, table);
      return run;
    } catch (const Error&) {
      if (!of_first) of_first = std::current_exception();
    }
  std::rethrow_exception(of_first);
}

/// [[design]]: a run for each of its points.
std::vector<StudyRun> read_design(const SceneNode& table, const Common& common,
                                  const std::filesystem::path& directory) {
  StudyRun base;
  base.name = base.design = text_of(table, "name", "[[design]]", true);
  const std::string title = fmt::format("the design '{}'", base.name);
  require_known(
      table, title,
      {"name", "scene", "kind", "count", "seed", "task", "parameters", "outputs", "pareto", "set", "options", "vary"});
  base.task = word_of(table, "task", title, study_tasks(), false);
  read_scene_of(base, table, title, common, directory);
  base.outputs = texts_of(table, "outputs", title);
  if (!base.outputs.empty() && base.task != "simulate")
    fail(table.find("outputs")->where, fmt::format("'outputs' in {}: these are values at the end of a simulation; the "
                                                   "task must be \"simulate\".",
                                                   title));
  base.pareto = texts_of(table, "pareto", title);
  if (base.pareto.size() == 1)
    fail(table.find("pareto")->where,
         fmt::format("'pareto' in {} needs two quantities or more that are to be small.", title));
  const std::string kind = word_of(table, "kind", title, design_kinds(), true);
  const bool grid = kind == "grid";
  const SceneNode* vary = table.find("vary");
  std::vector<Variation> variations;
  if (vary != nullptr) add_variations(require_table(*vary, "'vary' in " + title), "", grid, variations);
  if (variations.empty())
    fail(table.where, fmt::format("{} needs 'vary', a table of numbers by path and what becomes of them, such as "
                                  "{{ from = 1, to = 2 }}.",
                                  title));
  if (grid && table.find("count") != nullptr)
    fail(table.find("count")->where,
         fmt::format("'count' in {}: a grid has as many points as its 'steps' make.", title));
  const int count = grid ? 0 : count_of(table, "count", title, 1);
  if (const auto* seed = table.find("seed"); seed && !draws_points(kind, variations.size()))
    fail(seed->where, fmt::format("'seed' in {}: nothing is drawn at random in a design of kind '{}' of {} numbers; "
                                  "leave it out.",
                                  title, kind, variations.size()));
  const int seed = table.find("seed") != nullptr ? count_of(table, "seed", title, 0) : 1;
  base.blocks = kind == "saltelli";
  double size = base.blocks ? count * (static_cast<double>(variations.size()) + 2) : 1;
  for (const Variation& v : variations) size *= grid ? v.steps : 1;
  if (size > kMostPoints)
    fail(vary->where, fmt::format("{} has {:g} points, more than {:g}; give fewer {}.", title, size, kMostPoints,
                                  base.blocks ? "blocks" : "steps"));
  std::vector<std::vector<double>> points;
  try {
    points = design_points(kind, variations, count, static_cast<unsigned long>(seed));
  } catch (const Error& e) {
    fail(table.where, fmt::format("{}: {}", title, e.what()));
  }
  std::vector<std::vector<std::pair<std::string, double>>> numbers;
  try {
    numbers = numbers_of(base, variations);
  } catch (const Error& e) {
    fail(table.where, fmt::format("{}: {}", title, e.what()));
  }
  std::vector<StudyRun> runs;
  for (const auto& point : points) {
    StudyRun run = base;
    run.name = fmt::format("{}.{:0{}}", base.design, runs.size() + 1, fmt::formatted_size("{}", points.size()));
    for (std::size_t k = 0; k < variations.size(); ++k) {
      run.varied.emplace_back(variations[k].path, point[k]);
      for (const auto& [path, factor] : numbers[k])
        run.overrides.push_back(fmt::format("{}={}", path, factor * point[k]));
    }
    runs.push_back(std::move(run));
  }
  const StudyRun of_all = first_that_loads(runs, table);
  // Points of a grid are no sample of a distribution: its ends count as much as what lies between them.
  if (!grid && (of_all.task == "gradient" || (of_all.task == "cycle" && of_all.costs)))
    base.slope_parameters = parameters_of(of_all, variations);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    StudyRun& run = runs[i];
    run.slope_parameters = base.slope_parameters;
    for (std::size_t k = 0; k < run.slope_parameters.size(); ++k)
      run.slope_factors.push_back(variations[k].slope_factor(points[i][k]));
    run.scene_text = of_all.scene_text;
    run.files = of_all.files;
    run.costs = of_all.costs;
  }
  return runs;
}

}  // namespace

Study read_study(const std::string& path, const std::vector<std::string>& selected,
                 const std::vector<std::string>& overrides) {
  const SceneNode root = read_toml(read_text_file(path, kLongestFile, "The study"), path);
  require_known(root, "the study", {"title", "set", "options", "run", "design"});
  Study study;
  study.title = text_of(root, "title", "the study", false);
  Common common;
  common.last = overrides;
  if (const SceneNode* set = root.find("set")) add_overrides(require_table(*set, "'set'"), "", common.overrides);
  common.options = root.find("options");
  const SceneNode *runs = root.find("run"), *designs = root.find("design");
  for (const SceneNode* list : {runs, designs})
    if (list != nullptr && !list->is_table_array())
      fail(list->where, "A study lists its runs and designs, each with the header [[run]] or [[design]].");
  if (runs == nullptr && designs == nullptr)
    fail(SourceLocation{path, 0, 0}, "A study lists its runs, each with the header [[run]], or designs, [[design]].");
  std::vector<std::string> names;
  std::vector<const SceneNode*> tables;
  for (const SceneNode* list : {runs, designs})
    for (std::size_t i = 0; list != nullptr && i < list->children.size(); ++i) {
      const SceneNode& table = list->children[i];
      const std::string name = text_of(table, "name", list == runs ? "[[run]]" : "[[design]]", true);
      if (std::find(names.begin(), names.end(), name) != names.end())
        fail(table.where, fmt::format("There are two runs named '{}'.", name));
      names.push_back(name);
      tables.push_back(&table);
      const std::string task = word_of(table, "task", "'" + name + "'", study_tasks(), false);
      if (std::find(common.tasks.begin(), common.tasks.end(), task) == common.tasks.end()) common.tasks.push_back(task);
    }
  for (const auto& pattern : selected)
    if (std::none_of(names.begin(), names.end(),
                     [&](const auto& n) { return ::fnmatch(pattern.c_str(), n.c_str(), 0) == 0; }))
      throw Error(fmt::format("--only: There is no run '{}'.{}", pattern, suggestion(pattern, names)));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool wanted = selected.empty() || std::any_of(selected.begin(), selected.end(), [&](const auto& pattern) {
                          return ::fnmatch(pattern.c_str(), names[i].c_str(), 0) == 0;
                        });
    if (!wanted) continue;
    const auto directory = std::filesystem::path(path).parent_path();
    if (runs != nullptr && i < runs->children.size())
      study.runs.push_back(read_run(*tables[i], common, directory));
    else
      for (auto& run : read_design(*tables[i], common, directory)) study.runs.push_back(std::move(run));
  }
  return study;
}

}  // namespace costate::app
