#include "costate/scene/scene_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <set>
#include <tuple>

#include "costate/base/error.h"
#include "costate/base/stop.h"
#include "costate/formulation/defaults.h"
#include "costate/scene/least_atol.h"
#include "costate/scene/parameter_start.h"
#include "costate/scene/wanted_part.h"

namespace costate {

namespace {

const std::vector<std::string> settings = {"title", "description", "gravity",  "start", "parameter", "cost",
                                           "run",   "formulation", "optimize", "cycle", "case"};

/// Runs f; an error without a subject gets this one.
template <class F>
decltype(auto) at(const std::string& subject, const F& f) {
  try {
    return f();
  } catch (const ModelError& e) {
    throw ModelError(e.subject().empty() ? subject : e.subject(), e.bare_message());
  }
}

}  // namespace

void check_name(const SceneTable& table, const std::string& name) {
  const bool good = !name.empty() && name.find_first_of("./[]=\"'\\ \t\r\n") == std::string::npos;
  if (!good)
    throw SceneError(table.where(), fmt::format("'{}' cannot be a name: it must not be empty nor hold dots, slashes, "
                                                "brackets, quotes, '=' or blanks, because paths such as "
                                                "spring.S1.preload_N, in files /outputs/S1.force, are made of names.",
                                                name));
}

std::optional<SourceLocation> locate_path(const SceneNode& root, const std::string& path) {
  int depth = 0;
  const SceneNode* deepest = nullptr;
  try {
    const SceneNode* found = path.empty() ? nullptr : find_node(root, path, &depth, &deepest);
    if (found) return found->where;
  } catch (const Error&) {
    return {};
  }
  if (depth >= 2) return deepest->where;
  // A key missing from [run], [start], ...: that table. Of [spring.S1] without S1 there is no place.
  if (depth == 1 && std::find(settings.begin(), settings.end(), deepest->key) != settings.end() &&
      deepest->key != "parameter")
    return deepest->where;
  return {};
}

SceneError SceneReader::located(const ModelError& e, const std::string& file_name) const {
  auto where = locate_path(root_, e.subject());
  if (!where) where = here_;
  return SceneError(where.value_or(SourceLocation{file_name, 0, 0}), e.what());
}

void SceneReader::read() {
  check_top_level();
  title = table_.text("title", "");
  description = table_.text("description", "");
  read_gravity();
  collect_entries();
  read_entries();
  if (table_.has("cost")) {
    SceneTable cost = table_.table("cost");
    cost_ = read_cost(cost, builder_);
    cost.finish();
  }
  read_end();
  read_cycle();
  read_cases();
  read_optimize();
  read_formulation();
  read_start();
  read_parameters();
  read_run();
  build();
  check_outputs();
  objective = cost_.make(*mechanism);
  for (auto& c : planned_constraints_) constraints.push_back({c.name, c.upper, c.cost.make(*mechanism)});
  table_.finish();
}

void SceneReader::check_top_level() const {
  std::vector<std::string> known = settings;
  for (const auto& k : scene_kinds()) known.push_back(k.name);
  for (const auto& c : root_.children) {
    if (std::find(known.begin(), known.end(), c.key) != known.end()) continue;
    const std::string near = nearest_name(c.key, known);
    throw SceneError(c.key_where,
                     fmt::format("Unknown {} '{}' at the top of the scene.{} Known here: {}.",
                                 c.is_table() || c.is_array() ? "table" : "key", c.key,
                                 near.empty() ? "" : fmt::format(" Did you mean '{}'?", near), fmt::join(known, ", ")));
  }
}

void SceneReader::read_gravity() {
  if (!table_.has("gravity")) return;
  SceneTable t = table_.table("gravity");
  const double x = t.value("x_m_per_s2", NumberRule::any, 0), y = t.value("y_m_per_s2", NumberRule::any, 0);
  const double z = t.value("z_m_per_s2", NumberRule::any, 0);
  t.finish();
  builder_.set_gravity(x, y, z);
}

void SceneReader::collect_entries() {
  for (const auto& kind : scene_kinds()) {
    if (!table_.has(kind.name)) continue;
    SceneTable group = table_.table(kind.name);
    for (const auto& name : group.keys()) {
      if (!group.is_table(name))
        group.fail(name, fmt::format("must be a table: give the {} a name, [{}.NAME], and its keys below.", kind.name,
                                     kind.name));
      SceneTable t = group.table(name);
      check_name(t, name);
      const ScenePhase phase = kind.phase_of ? kind.phase_of(t) : kind.phase;
      SourceLocation where = t.where();
      if (where.line == 0) where.line = std::numeric_limits<int>::max();  // an override's: behind its file's
      entries_.push_back({&kind, name, t, phase, where});
    }
  }
  std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return std::tuple(a.phase, a.table.part(), a.where.line, a.where.column) <
           std::tuple(b.phase, b.table.part(), b.where.line, b.where.column);
  });
}

namespace {
/// Items of arrays that the scene leaves out, a table's defaults: there is no place to write a value of theirs to.
void fix_unwritten_items(const SceneTable& table, MechanismBuilder& builder) {
  const auto written = table.keys();
  for (const auto& key : table.known_keys()) {
    if (std::find(written.begin(), written.end(), key) != written.end()) continue;
    for (int i = 0; builder.has_number(fmt::format("{}[{}]", table.path(key), i)); ++i)
      builder.fix_number(
          builder.number(fmt::format("{}[{}]", table.path(key), i)),
          fmt::format("the scene leaves it out; write {} = [...] in [{}] to vary it.", key, table.path()));
  }
}
}  // namespace

void SceneReader::read_entries() {
  for (Entry& e : entries_) {
    check_stop();
    here_ = e.table.where();
    if (const WantedPart* part = WantedPart::current(); part && part->leaves_out(e.table.path())) {
      part->add_numbers(e.table.path(), builder_);
      for (const auto& key : e.table.keys()) e.table.has(key);  // they were known when the whole was read
      continue;
    }
    try {
      at(e.table.path(), [&] { e.kind->add(e.name, e.table, builder_); });
    } catch (const std::bad_alloc&) {
      throw SceneError(*here_, fmt::format("[{}] needs more memory than there is.", e.table.path()));
    }
    fix_unwritten_items(e.table, builder_);
    e.table.finish();
  }
  here_.reset();
}

void SceneReader::read_start() {
  if (!table_.has("start")) return;
  SceneTable t = table_.table("start");
  const bool equilibrium = t.flag("equilibrium", false);
  const bool own_velocities = t.has("given_velocities");
  const auto given = t.texts("given", !equilibrium);
  const auto velocities = own_velocities ? t.texts("given_velocities") : given;
  t.finish();
  const std::string velocity_key = own_velocities ? "start.given_velocities" : "start.given";
  const auto give = [&](const std::string& where, const auto& f) {
    try {
      at(where, f);
    } catch (const ModelError&) {
      if (!WantedPart::current()) throw;  // else it is of what is left out
    }
  };
  for (std::size_t i = 0; i < given.size(); ++i)
    give(fmt::format("start.given[{}]", i), [&] { builder_.give_position(given[i]); });
  for (std::size_t i = 0; i < velocities.size(); ++i)
    give(fmt::format("{}[{}]", velocity_key, i), [&] { builder_.give_velocity(velocities[i]); });
  if (!equilibrium) return;
  builder_.start_at_equilibrium();
  for (const auto& path : builder_.initial_state_paths())
    if (find_node(root_, path)) builder_.hold_initial_state(path);
}

void SceneReader::read_parameters() {
  if (!table_.has("parameter")) return;
  SceneTable group = table_.table("parameter");
  for (const auto& name : group.keys()) {
    check_stop();
    SceneTable t = group.table(name);
    check_name(t, name);
    here_ = t.where();
    Parameter p;
    p.name = name;
    const bool several = t.has("numbers");
    if (several && t.has("number")) t.fail("number", "contradicts 'numbers': give one of them.");
    const auto paths = several ? t.texts("numbers") : std::vector<std::string>{t.text("number")};
    std::vector<double> factors(paths.size(), 1.0);
    if (t.has("factors")) factors = t.values("factors");
    if (factors.size() != paths.size())
      t.fail("factors", fmt::format("must hold one factor a number, found {} for {}.", factors.size(), paths.size()));
    for (std::size_t i = 0; i < paths.size(); ++i)
      at(several ? fmt::format("{}[{}]", t.path("numbers"), i) : t.path("number"), [&] {
        const int number = builder_.number(paths[i]);
        for (const auto& binding : p.bindings)
          if (binding.first == number)
            throw ModelError("", fmt::format("'{}' is listed twice: a number has one factor.", paths[i]));
        p.bindings.emplace_back(number, factors[i]);
      });
    p.lower = t.find_value("lower").value_or(p.lower);
    p.upper = t.find_value("upper").value_or(p.upper);
    if (p.lower > p.upper) t.fail("lower", fmt::format("is {}, above 'upper' = {}.", p.lower, p.upper));
    const auto scale = t.find_value("scale", NumberRule::positive);
    t.finish();
    if (paths.empty()) t.fail("numbers", "must name at least one number.");
    if (factors[0] == 0) t.fail("factors", "must not hold a zero.");
    const double start = builder_.number_value(p.bindings[0].first) / factors[0];
    for (const auto& [number, factor] : p.bindings)
      if (!std::isfinite(start) || !std::isfinite(factor * start))
        t.fail("factors",
               fmt::format("make numbers too large to be held: the parameter's value is {:g} / {:g} = {:g}, "
                           "and {:g} times that is {:g}.",
                           builder_.number_value(p.bindings[0].first), factors[0], start, factor, factor * start));
    check_start(p, start, root_, paths[0], t);
    p.scale = scale.value_or(start != 0 ? std::abs(start) : 1);
    builder_.add_parameter(p);
  }
  here_.reset();
}

/// Whether there are some thousand numbers between the two times.
static bool long_enough(double t_start, double t_end) {
  return t_end - t_start > 1e-12 * std::max(std::abs(t_start), std::abs(t_end));
}

void SceneReader::read_end() {
  if (!table_.has("run") || !table_.table("run").has("ends_when")) return;
  SceneTable run_table = table_.table("run");
  if (!run_table.is_table("ends_when"))
    run_table.fail_type("ends_when", "a table such as { output = \"hip.x\", above = 2.0 }");
  SceneTable t = run_table.table("ends_when");
  EndSettings end;
  end.output = t.text("output");
  const bool above = t.has("above"), below = t.has("below");
  if (above == below)
    t.fail(fmt::format("needs one of 'above' and 'below', the level that '{}' crosses; found {}.", end.output,
                       above ? "both" : "none"));
  end.above = above;
  end.level_number = t.number(above ? "above" : "below", builder_);
  t.finish();
  run.ends_when = end;
}

void SceneReader::read_run() {
  if (!table_.has("run")) return;
  SceneTable t = table_.table("run");
  here_ = t.where();
  run.t_start_s = t.value("t_start_s", NumberRule::any, 0);
  run.t_end_s = t.value("t_end_s");
  t.has("ends_when");  // read_end()
  t.has("cycle");      // read_cycle()
  if (!(run.t_end_s > run.t_start_s))
    t.fail("t_end_s", fmt::format("must be after t_start_s = {}, found {}.", run.t_start_s, run.t_end_s));
  if (!long_enough(run.t_start_s, run.t_end_s))
    t.fail("t_end_s", fmt::format("is {}, so near t_start_s = {} that there are hardly numbers between them.",
                                  run.t_end_s, run.t_start_s));
  std::vector<std::string> names;
  for (const auto& f : formulations()) names.push_back(f.name);
  run.formulation = t.one_of("formulation", names, run.formulation);
  run.method_given = t.has("method");
  run.method = t.text("method", run.method);
  run.integrator = t.text("integrator", run.integrator);
  run.cvodes_method = t.has("cvodes_method") ? t.one_of("cvodes_method", {"adams", "bdf"}) : run.cvodes_method;
  run.sensitivity_corrector = t.has("sensitivity_corrector")
                                  ? t.one_of("sensitivity_corrector", {"staggered", "simultaneous"})
                                  : run.sensitivity_corrector;
  run.parameters = t.texts("parameters", false);
  run.rtol = t.value("rtol", NumberRule::positive, run.rtol);
  if (run.rtol >= 1) t.fail("rtol", fmt::format("must be below 1, found {}.", run.rtol));
  run.atol = t.find_value("atol", NumberRule::positive);
  if (run.atol && *run.atol < kLeastAtol)
    t.fail("atol", fmt::format("must be at least {}, found {}.", kLeastAtol, *run.atol));
  if (run.atol && *run.atol >= 1)
    t.fail("atol", fmt::format("must be below 1 (in SI units, of every unknown), found {}.", *run.atol));
  run.accuracy = t.find_value("accuracy", NumberRule::positive);
  if (run.accuracy && *run.accuracy >= 1) t.fail("accuracy", fmt::format("must be below 1, found {}.", *run.accuracy));
  if (run.accuracy && t.has("rtol"))
    t.fail("accuracy", "chooses the tolerance itself: 'rtol' and it exclude each other.");
  run.step_s = t.find_value("step_s", NumberRule::positive);
  run.max_step_s = t.find_value("max_step_s", NumberRule::positive);
  run.output_step_s = t.find_value("output_step_s", NumberRule::positive);
  run.outputs = t.texts("outputs", false);
  run.events = t.flag("events", run.events);
  t.flag("everything", false);  // of the whole scene: asks_for_everything()
  t.finish();
  std::vector<std::string> known =
      table_.has("parameter") ? table_.table("parameter").keys() : std::vector<std::string>();
  const std::set<std::string> named(known.begin(), known.end());
  std::set<std::string> listed;
  for (std::size_t i = 0; i < run.parameters.size(); ++i) {
    const std::string& name = run.parameters[i];
    if (!builder_.has_number(name) && named.count(name) == 0)
      throw ModelError(fmt::format("run.parameters[{}]", i),
                       fmt::format("There is no parameter '{}'.{}", name, suggestion(name, known)));
    if (!listed.insert(name).second)
      throw ModelError(fmt::format("run.parameters[{}]", i), fmt::format("Parameter '{}' is listed twice.", name));
  }
  builder_.set_default_parameters(run.parameters);
}

void SceneReader::read_formulation() {
  if (!table_.has("formulation")) return;
  SceneTable t = table_.table("formulation");
  for (const auto& [key, option] : formulation_options()) {
    const bool given = t.has(key);
    if (option.is_number()) {
      const double x = t.value(key, option.rule, option.number);
      if (const std::string wrong = option.objection(x); !wrong.empty())
        t.fail(key, fmt::format("{}, found {}.", wrong, x));
      if (given) formulation.set(key, x);
    } else {
      const std::string word = t.one_of(key, option.words, option.words.front());
      if (given) formulation.set(key, word);
    }
  }
  t.finish();
}

void SceneReader::read_optimize() {
  if (!table_.has("optimize")) return;
  SceneTable t = table_.table("optimize");
  const std::vector<std::string>& algorithms = setting_words("optimize.algorithm");
  optimize.algorithm = algorithms.empty() ? t.text("algorithm", optimize.algorithm)
                                          : t.one_of("algorithm", algorithms, optimize.algorithm);
  optimize.algorithm_chosen = t.has("algorithm");
  optimize.goal = t.one_of("goal", {"sum", "worst"}, optimize.goal);
  if (t.has("goal") && cases.empty()) t.fail("goal", "says what is made of several cases, and there is no [[case]].");
  optimize.max_evaluations = t.whole_number("max_evaluations", optimize.max_evaluations);
  optimize.stop_value = t.find_value("stop_value");
  optimize.relative_tolerance = t.value("relative_tolerance", NumberRule::non_negative, optimize.relative_tolerance);
  optimize.gradient_tolerance = t.value("gradient_tolerance", NumberRule::non_negative, optimize.gradient_tolerance);
  for (SceneTable& c : t.tables("constraint")) {
    PlannedConstraint p{c.text("name"), c.value("upper"), read_cost(c, builder_)};
    if (p.cost.running.empty() && p.cost.terminal.empty())
      c.fail("needs at least one term: [[optimize.constraint.running]] or [[optimize.constraint.terminal]].");
    planned_constraints_.push_back(std::move(p));
  }
  t.finish();
}

void SceneReader::build() {
  try {
    mechanism = builder_.build();
    // Those that the default list leaves out must be able to vary, too.
    if (table_.has("parameter"))
      for (const auto& p : mechanism->parameters())
        for (const auto& [number, factor] : p.bindings)
          if (!mechanism->numbers()[static_cast<std::size_t>(number)].fixed_because.empty())
            mechanism->select({p.name});
  } catch (const ModelError& e) {
    // A number that [run] lists by its path has no table [parameter.*] to point at.
    for (std::size_t i = 0; i < run.parameters.size(); ++i)
      if (e.subject() == "parameter." + run.parameters[i] && !find_node(root_, "parameter." + run.parameters[i]))
        throw ModelError(fmt::format("run.parameters[{}]", i), e.bare_message());
    throw;
  }
}

}  // namespace costate
