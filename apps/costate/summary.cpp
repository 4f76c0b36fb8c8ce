// A run's summary: its JSON object, and how a command ends with it.
#include <fmt/format.h>
#include <sundials/sundials_version.h>

#include <Eigen/Core>
#include <algorithm>

#include "command.h"
#include "costate/analysis/start_remarks.h"
#include "costate/base/notice.h"
#include "costate/base/version.h"
#include "costate/integrator/simulate.h"
#include "costate/optimize/optimizer.h"
#include "costate/record/atomic_file.h"
#include "costate/record/json_number.h"
#include "costate/record/print.h"
#include "explain/left_out.h"
#include "guide.h"
#include "saving.h"
#include "start_notice.h"

namespace costate::app {

Json counters_json(const Counters& c) {
  Json j;
  for (const auto& [name, value] : counter_list(c)) j[name] = value;
  return j;
}

Json settings_json(const Setup& setup) {
  Json j;
  const SolverOptions& s = setup.problem.solver;
  j["scene"] = Json::parse(json_text(setup.scene.file_name()));
  j["title"] = setup.scene.title;
  j["t_start_s"] = s.t_start;
  j["t_end_s"] = s.t_end;
  j["atol"] = s.absolute();
  j["cvodes_method"] = s.cvodes_method;
  j["sensitivity_corrector"] = s.staggered ? "staggered" : "simultaneous";
  j["step_s"] = s.step_s;
  j["checkpoint_steps"] = s.checkpoint_steps;
  const FormulationOptions& f = setup.problem.formulation_options;
  for (const auto& [key, o] : formulation_options()) j[key] = o.is_number() ? Json(o.number_in(f)) : Json(o.word_in(f));
  char sundials[32] = {};
  SUNDIALSGetVersion(sundials, sizeof sundials);
  j["versions"] = {{"costate", std::string(version)},
                   {"sundials", sundials},
                   {"nlopt", nlopt_version_text()},
                   {"eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)}};
  return j;
}

Json warnings_of(const Setup& setup) {
  Json j = {{"warnings", setup.noticed}};
  add_notices(j);
  return j.at("warnings");
}

void add_notices(Json& summary) {
  Json& warnings = summary["warnings"];
  if (!warnings.is_array()) warnings = Json::array();
  for (const auto& sentence : take_notices())
    if (std::find(warnings.begin(), warnings.end(), Json(sentence)) == warnings.end()) warnings.push_back(sentence);
}

void tell_without_parameters(const Mechanism& mechanism, const ParameterSelection& chosen) {
  if (chosen.size() > 0) return;
  std::string named;
  for (const Parameter& p : mechanism.parameters()) named += (named.empty() ? "" : ",") + p.name;
  notice(
      fmt::format("There is no parameter to differentiate by: the scene's [run] has no 'parameters'. Give some: "
                  "--parameters {}.",
                  named.empty() ? "with paths of numbers, which 'costate list SCENE' shows" : named));
}

void print_warnings(const std::vector<std::string>& warnings) {
  constexpr std::size_t told = 5;
  for (std::size_t i = 0; i < std::min(told, warnings.size()); ++i)
    print_message(fmt::format("warning: {}", with_guide(warnings[i])));
  if (warnings.size() > told)
    print_message(fmt::format("warning: {} more like these, see \"warnings\" in the summary.", warnings.size() - told));
}

namespace {

std::vector<std::string> remarks_about_start(const Setup& setup) {
  const Saving saving;  // the run that started here has ended
  Assembly assembly(setup.problem.mechanism, setup.problem.parameters);
  assembly.set_parameters(setup.rho.data());
  return start_remarks(assembly, find_start(assembly, setup.problem.solver.t_start, false));
}

}  // namespace

void notice_start(const Setup& setup) {
  try {
    for (const auto& remark : remarks_about_start(setup)) notice(remark);
  } catch (const Error&) {
    // It is the start that fails, which is told already.
  }
}

Json run_json(const Setup& setup, const GradientResult& r, const std::string& method, double wall_s) {
  const auto names = setup.problem.parameters.names();
  Json j;
  j["psi"] = r.psi;
  j["parameters"] = named(names, setup.rho);
  j["gradient"] = method.empty() ? Json(nullptr) : named(names, r.gradient);
  j["gradient_error"] = r.gradient_error.empty() ? Json(nullptr) : named(names, r.gradient_error);
  j["formulation"] = setup.problem.formulation;
  j["integrator"] = r.integrator;
  j["method"] = method.empty() ? Json(nullptr) : Json(method);
  j["rtol"] = setup.problem.solver.rtol;
  j["counters"] = counters_json(r.counters);
  j["wall_s"] = wall_s;
  if (MotionEvents::has_any(*setup.problem.mechanism)) {
    j["events"] = Json::array();
    for (const RunEvent& e : r.events)
      j["events"].push_back(
          {{"t", e.t}, {"name", e.name}, {"mode", e.mode}, {"jump", e.jump}, {"energy_lost_J", e.energy_lost}});
  }
  if (r.end) j["end"] = {{"t", r.end->t}, {"name", r.end->name}};
  j["status"] = "ok";
  j["warnings"] = warnings_of(setup);
  j["settings"] = settings_json(setup);
  for (const auto& remark : remarks_about_start(setup)) j["warnings"].push_back(remark);
  return j;
}

namespace {

/// The settings and all counters that are not zero, for --verbose.
std::string details(const Json& json) {
  const auto list = [](const char* title, const Json& entries) {
    std::string text;
    for (const auto& [name, value] : entries.items())
      if (value.is_primitive() && value != 0 && value != "")
        text += fmt::format("{} {} {}", text.empty() ? "" : ",", name,
                            value.is_string() ? value.get<std::string>() : value.dump());
    return fmt::format("  {}:{}\n", title, text);
  };
  // Commands of many runs have no counters of their own.
  const Json& settings = json.at("settings");
  return (json.contains("counters") ? list("counters", json.at("counters")) : "") + list("settings", settings) +
         (settings.contains("versions") ? list("versions", settings.at("versions")) : "");
}

}  // namespace

void report(const Setup& setup, const CommonOptions& options, const Json& json, const std::string& text,
            const std::string& file) {
  // What was noticed behind the summary's own runs (a reference, the motion at an optimum) belongs to it, too.
  Json whole = json;
  for (const auto& sentence : setup.noticed) notice(sentence);
  add_notices(whole);
  const LeftOut rest = left_out(setup);
  if (!rest.coordinates.empty()) whole["left_out"] = left_out_json(rest);
  if (options.take) return options.take(setup, whole);
  const std::string object = json_text(whole) + "\n";
  const bool written = setup.write_file(file, [&](const auto& path) { write_file_atomically(path, object); });
  if (options.hand_over) return options.hand_over(whole);
  print_warnings(whole.at("warnings").get<std::vector<std::string>>());
  if (options.json)
    fmt::print("{}", object);
  else if (!options.quiet) {
    print_result(text + left_out_text(rest));
    if (options.verbose) print_result(details(json));
    if (written) print_result(fmt::format("  summary: {}\n", (setup.directory / file).string()));
  }
}

double seconds_since(const std::chrono::steady_clock::time_point& begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace costate::app
