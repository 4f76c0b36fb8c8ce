#include "design_setup.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/base/stop.h"
#include "costate/base/unsaid.h"
#include "costate/problem/scene_problem.h"
#include "costate/record/interrupt.h"
#include "digits.h"
#include "explain/left_out.h"
#include "trajectory.h"

namespace costate::app {

namespace {

bool lists(const std::vector<std::string>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

/// Whether a value of the scene that lists cases counts where none of them is that scene: what is of the design, and
/// numbers that its parameters vary.
bool is_of_design(const Scene& scene, const std::string& path, const std::vector<std::string>& parameters) {
  const std::string first = path.substr(0, path.find_first_of(".["));
  if (lists({"case", "optimize", "parameter", "title", "description"}, first) || path == "run.parameters") return true;
  const Mechanism& m = *scene.mechanism();
  for (const Parameter& p : m.select(parameters.empty() ? scene.run.parameters : parameters).parameters)
    for (const auto& [number, factor] : p.bindings)
      if (m.numbers()[static_cast<std::size_t>(number)].path == path) return true;
  return false;
}

/// --set changes the scene that was named. Where no case is that scene, little of it counts.
void require_effect(const Scene& scene, const std::vector<std::string>& overrides,
                    const std::vector<std::string>& parameters) {
  const auto& cases = scene.cases;
  if (std::any_of(cases.begin(), cases.end(), [](const SceneCase& c) { return c.file.empty(); })) return;
  for (const std::string& o : overrides)
    if (const std::string path = o.substr(0, o.find('=')); !is_of_design(scene, path, parameters))
      throw Error(
          fmt::format("--set {}: every case has a scene of its own, and it is no number that a parameter of the "
                      "design varies, so that this would change nothing. Set it in a case: --set "
                      "'case[0].set={{ \"{}\" = ... }}', or in its file.",
                      o, path));
}

/// The design's parameters that a case has; each of them by its name there.
std::vector<std::string> parameters_of(const SceneCase& c, const std::vector<std::string>& all) {
  for (const std::string& name : c.without)
    if (!lists(all, name))
      throw SceneError(c.where, fmt::format("The case '{}' is without '{}', which is no parameter of the design.{}",
                                            c.name, name, suggestion(name, all)));
  std::vector<std::string> own;
  for (const std::string& name : all) {
    if (lists(c.without, name)) continue;
    try {
      c.scene->mechanism()->select({name});
    } catch (const Error&) {
      throw SceneError(c.where, fmt::format("The case '{}' has no parameter '{}' ({}). Give it [parameter.{}], or say "
                                            "that it does not depend on it: without = [\"{}\"].",
                                            c.name, name, c.scene->file_name(), name, name));
    }
    own.push_back(name);
  }
  if (own.empty() && !all.empty())
    throw SceneError(c.where, fmt::format("The case '{}' depends on no parameter of the design.", c.name));
  return own;
}

/// Of the scene itself, whose cases are runs of their own.
Setup setup_alone(const CommonOptions& common, Scene scene) {
  CommonOptions own = common;
  scene.cases.clear();
  own.overrides.clear();
  own.case_name.clear();
  own.ready = std::make_shared<const Scene>(std::move(scene));
  return Setup(own, Purpose::differentiate);
}

/// What is known of a run's psi relatively; 0 where it is that of its own fixed steps.
double known_psi(const Setup& s) {
  return by_fixed_steps(s.problem, find_sensitivity_method(s.method)) ? 0 : s.problem.solver.rtol;
}

std::string common_word(const std::vector<std::string>& words) {
  return std::all_of(words.begin(), words.end(), [&](const auto& w) { return w == words.front(); }) ? words.front()
                                                                                                    : "";
}

}  // namespace

DesignSetup::DesignSetup(const CommonOptions& common, const std::string& goal)
    : setup([&] {
        Scene scene = load_scene(common);
        if (!scene.cases.empty()) require_effect(scene, common.overrides, common.parameters);
        of = scene.cases;
        return setup_alone(common, std::move(scene));
      }()) {
  if (of.empty() && !goal.empty())
    throw Error("--goal says what is made of several cases, and the scene lists none ([[case]]).");
  goal_ = (goal.empty() ? setup.scene.optimize.goal : goal) == "worst" ? Design::Goal::worst : Design::Goal::sum;
  for (const SceneCase& c : of) add_case(common, c);
  if (!several()) {
    leave_out_rest(setup);
    return;
  }
  const bool own = std::any_of(of.begin(), of.end(), [](const SceneCase& c) { return c.file.empty(); });
  if (!own && !setup.scene.constraints().empty())
    throw SceneError(setup.scene.locate("optimize.constraint"),
                     "These constraints are those of no case: each case has a scene of its own. Give them to one, or "
                     "make a case of this scene: [[case]] without 'scene'.");
  for (const std::string& name : setup.problem.parameters.names())
    if (std::all_of(of.begin(), of.end(), [&](const SceneCase& c) { return lists(c.without, name); }))
      throw SceneError(of.front().where, fmt::format("No case depends on the parameter '{}'.", name));
}

void DesignSetup::add_case(const CommonOptions& common, const SceneCase& c) {
  CommonOptions own = common;
  own.scene = c.scene->file_name();
  own.ready = c.scene;
  own.overrides.clear();
  own.case_name.clear();
  own.parameters = parameters_of(c, setup.problem.parameters.names());
  try {
    cases.emplace_back(own, Purpose::differentiate);
  } catch (const SceneError&) {
    throw;
  } catch (const Error& e) {
    throw Error(fmt::format("case.{}: {}", c.name, e.what()));
  }
  Setup& s = cases.back();
  s.directory = setup.directory;
  if (own.parameters.empty()) {  // of a design that has none; not those that the case's scene names
    s.problem.parameters = {};
    s.rho.clear();
  }
  const Objective& cost = s.problem.objective;
  if (cost.running.empty() && cost.terminal.empty())
    throw SceneError(c.where, fmt::format("The case '{}' has no cost: its scene ({}) needs a term under "
                                          "[[cost.running]] or [[cost.terminal]].",
                                          c.name, c.scene->file_name()));
  leave_out_rest(s);
}

Design DesignSetup::design() const {
  const auto constraints_of = [](const Setup& s) {
    std::vector<OptimizerConstraint> list;
    for (const auto& c : s.scene.constraints()) list.push_back({c.name, c.objective, c.upper});
    return list;
  };
  if (!several()) {
    Design d = single_design(setup.problem, setup.method, constraints_of(setup));
    d.cases.front().admit = [this](const std::vector<double>& rho) { require_scene(setup, rho); };
    return d;
  }
  Design d;
  d.parameters = setup.problem.parameters;
  d.goal = goal_;
  const std::vector<std::string> names = d.parameters.names();
  for (std::size_t i = 0; i < cases.size(); ++i) {
    DesignCase c;
    c.name = of[i].name;
    c.problem = cases[i].problem;
    c.method = cases[i].method;
    c.constraints = constraints_of(cases[i]);
    c.factor = of[i].weight / of[i].scale;
    c.upper = of[i].upper;
    for (const std::string& name : c.problem.parameters.names())
      c.places.push_back(static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin()));
    c.located = [s = &cases[i]](const std::function<void()>& f) { s->located(f); };
    c.admit = [s = &cases[i]](const std::vector<double>& rho) { require_scene(*s, rho); };
    d.cases.push_back(std::move(c));
    if (of[i].upper) continue;
    auto at =
        std::find_if(d.targets.begin(), d.targets.end(), [&](const auto& t) { return t.name == of[i].objective; });
    if (at == d.targets.end()) at = d.targets.insert(at, {of[i].objective, {}});
    at->cases.push_back(i);
  }
  return d;
}

void DesignSetup::watch(Progress& progress) {
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  for (std::size_t i = 0; i < cases.size(); ++i)
    cases[i].problem.monitor = i == 0 ? monitor(progress, cases[i].problem.solver.t_end) : [](double, long, bool) {
      throw_if_interrupted();
      check_stop();
    };
}

Json DesignSetup::cases_json(const std::vector<double>& psi, const std::vector<std::vector<double>>& gradients) const {
  Json list = Json::array();
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Setup& s = cases[i];
    Json j;
    j["name"] = of[i].name;
    j["scene"] = Json::parse(json_text(s.scene.file_name()));
    j["objective"] = of[i].upper ? Json() : Json(of[i].objective);
    j["weight"] = of[i].upper ? Json() : Json(of[i].weight);
    j["scale"] = of[i].upper ? Json() : Json(of[i].scale);
    j["upper"] = of[i].upper ? Json(*of[i].upper) : Json();
    j["psi"] = psi[i];
    j["gradient"] = named(setup.problem.parameters.names(), gradients[i]);
    j["formulation"] = s.problem.formulation;
    j["integrator"] = integrator_of(s.problem, find_sensitivity_method(s.method));
    j["method"] = s.method;
    j["rtol"] = s.problem.solver.rtol;
    j["t_end_s"] = s.problem.solver.t_end;
    if (const LeftOut rest = left_out(s); !rest.coordinates.empty()) j["left_out"] = left_out_json(rest);
    list.push_back(std::move(j));
  }
  return list;
}

nlohmann::json DesignSetup::identity() const {
  nlohmann::json j = {{"goal", goal_ == Design::Goal::worst ? "worst" : "sum"}, {"cases", nlohmann::json::array()}};
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Setup& s = cases[i];
    nlohmann::json settings(settings_json(s));
    settings.erase("scene");
    j["cases"].push_back({{"name", of[i].name},
                          {"scene", s.scene.dump()},
                          {"method", s.method},
                          {"formulation", s.problem.formulation},
                          {"integrator", s.problem.solver.integrator},
                          {"rtol", s.problem.solver.rtol},
                          {"settings", settings}});
  }
  return j;
}

void DesignSetup::correct(Json& summary) const {
  if (!several()) return;
  std::vector<std::string> formulations, integrators, methods;
  double rtol = 0;
  for (const Setup& s : cases) {
    formulations.push_back(s.problem.formulation);
    integrators.push_back(integrator_of(s.problem, find_sensitivity_method(s.method)));
    methods.push_back(s.method);
    rtol = std::max(rtol, s.problem.solver.rtol);
  }
  const auto word = [](const std::string& w) { return w.empty() ? Json() : Json(w); };
  summary["formulation"] = word(common_word(formulations));
  summary["integrator"] = word(common_word(integrators));
  summary["method"] = word(common_word(methods));
  summary["rtol"] = rtol;
  summary["goal"] = goal_ == Design::Goal::worst ? "worst" : "sum";
  summary.erase("events");  // of the scene that lists the cases
  summary.erase("end");
}

std::string DesignSetup::what() const {
  const bool worst = goal_ == Design::Goal::worst;
  return fmt::format("the {} of {} cases", worst ? "worst" : "sum", cases.size());
}

std::string DesignSetup::cases_text(const std::vector<double>& psi, const std::vector<double>& after) const {
  std::string text;
  std::size_t width = 0;
  for (const SceneCase& c : of) width = std::max(width, c.name.size());
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const auto digits = [&](double x) { return known_digits(x, uncertainty_of(x, known_psi(cases[i]))); };
    text += fmt::format("  case {:<{}}  psi = {:<16}", of[i].name, width, digits(psi[i]));
    if (!after.empty()) text += fmt::format(" -> {:<16}", digits(after[i]));
    text += of[i].upper ? fmt::format(" at most {:g}", *of[i].upper)
                        : fmt::format(" weight {:g}, scale {:g}", of[i].weight, of[i].scale);
    text += "\n";
  }
  return text;
}

double DesignSetup::psi_tolerance() const {
  double loosest = several() ? 0 : known_psi(setup);
  for (const Setup& s : cases) loosest = std::max(loosest, known_psi(s));
  return loosest;
}

void DesignSetup::refuse_accuracy(bool on_command_line) const {
  if (!several()) return;
  if (on_command_line)
    throw CapabilityError(
        "--accuracy is that of one run; a design of several cases takes tolerances: --rtol, or [run] "
        "rtol of each case. 'costate gradient --case NAME --accuracy' tells which a case needs.");
  for (const Setup& s : cases)
    if (s.scene.run.accuracy)
      throw SceneError(s.scene.locate("run.accuracy"),
                       "A case takes a tolerance, 'rtol', in the place of 'accuracy', which is that of one run alone.");
}

void require_scene(const Setup& setup, const std::vector<double>& rho) {
  const Unsaid reading;
  try {
    setup.scene.with_parameters(setup.problem.parameters, rho);
  } catch (const Error& e) {
    throw SolverError(
        fmt::format("{} 'lower' and 'upper' of a [parameter] keep the search where there is a scene.", e.what()));
  }
}

void add_goal_option(Command& c, std::string& goal) {
  c.option("--goal", goal, "Of several cases: sum (default) or worst").among({"sum", "worst"});
}

Scene scene_of_case(const Scene& design, const std::string& name, const std::vector<std::string>& parameters,
                    const std::vector<std::string>& overrides) {
  const SceneCase& c = design.find_case(name);
  const std::vector<std::string> all = parameters.empty() ? design.run.parameters : parameters,
                                 own = parameters_of(c, all);
  Scene scene = *c.scene;
  // --set has changed the scene that lists the cases; what is a run's own is meant for this one.
  for (const std::string& o : overrides)
    if (const std::string path = o.substr(0, o.find('=')); !c.file.empty() && !is_of_design(design, path, parameters))
      scene = scene.with_override(path, o.substr(path.size() + 1));
  if (own.empty()) return scene;
  scene = scene.with_parameters(scene.mechanism()->select(own), design.mechanism()->select(own).values());
  scene.run.parameters = own;
  return scene;
}

}  // namespace costate::app
