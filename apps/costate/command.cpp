#include "command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/discrete/discrete_scheme.h"
#include "costate/problem/scene_problem.h"
#include "costate/record/print.h"
#include "costate/scene/least_atol.h"
#include "design_setup.h"
#include "method_choice.h"

namespace costate::app {

void CommonOptions::add_to(Command& c) {
  c.option("scene", scene, "Scene file (TOML)").required();
  c.option("--set", overrides, "Replace a value of the scene: path=value (repeatable)")
      .value_name("PATH=VALUE")
      .repeatable();
  c.option("--case", case_name, "Of a scene with [[case]]: this one, at the design's parameters");
  c.flag("--no-files", no_files, "Write no files");
  c.flag("--quiet", quiet, "Print errors only");
}

namespace {
template <class List>
std::vector<std::string> names_of(const List& list) {
  std::vector<std::string> names;
  for (const auto& entry : list) names.push_back(entry.name);
  return names;
}

std::string capitalized(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}
}  // namespace

void CommonOptions::add_run_options(Command& c) {
  c.option("--parameters", parameters, "Parameters or number paths, separated by commas (default: the scene's)")
      .separated();  // what follows is the scene
  c.option("--formulation", formulation, "See 'costate list formulations'").suggests(names_of(formulations()));
  c.option("--method", method, "Gradient method, see 'costate list methods'").suggests(names_of(sensitivity_methods()));
  const std::vector<std::string> known = integrator_names();
  c.option("--integrator", integrator, fmt::format("{} (default: the formulation's)", fmt::join(known, ", ")))
      .suggests(known);
  c.option("--cvodes-method", cvodes_method, "adams (default; smooth motion) or bdf (stiff)")
      .suggests({"adams", "bdf"});
  c.option("--sensitivity-corrector", sensitivity_corrector,
           "Forward methods: staggered (default; sensitivities after the state) or simultaneous")
      .suggests({"staggered", "simultaneous"});
  c.option("--rtol", rtol, "Relative tolerance");
  c.option("--atol", atol, "Absolute tolerance in SI units (default: the number of rtol)");
  c.option("--t-end", t_end, "End of the simulation [s]");
  c.option("--step", step, "Step of fixed-step runs [s] (default: chosen from rtol)");
  for (const auto& [key, o] : formulation_options()) {
    if (o.flag.empty()) continue;
    if (o.is_number())
      c.option(o.flag, formulation_numbers[key], capitalized(o.help));
    else
      c.option(o.flag, formulation_words[key], capitalized(o.help)).among(o.words);
  }
  c.option("--checkpoint-steps", checkpoint_steps, "Steps between checkpoints of adjoint runs");
  c.option("--output", output, "Directory for result files (default: results/SCENE)");
  c.flag("--json", json, "Print one JSON object and nothing else");
  c.flag("--verbose", verbose, "Print settings and counters, too");
}

void add_jobs_option(Command& c, int& jobs, const std::string& what) {
  c.option("--jobs", jobs, what + " at a time (default: the number of cores); the numbers are the same")
      .between(0, 1e6);
}

Scene load_scene(const CommonOptions& options) {
  std::vector<std::pair<std::string, std::string>> values;
  for (const auto& o : options.overrides) {
    const auto equals = o.find('=');
    if (equals == std::string::npos || equals == 0)
      throw Error(fmt::format("--set needs PATH=VALUE, found '{}'. Example: --set run.t_end_s=2.", o));
    values.emplace_back(o.substr(0, equals), o.substr(equals + 1));
  }
  Scene scene = options.ready ? options.ready->with_overrides(values) : Scene::load(options.scene, options.overrides);
  if (options.case_name.empty()) return scene;
  try {
    return scene_of_case(scene, options.case_name, options.parameters, options.overrides);
  } catch (const SceneError&) {
    throw;
  } catch (const Error& e) {
    throw Error(fmt::format("--case: {}", e.what()));
  }
}

namespace {

void require_positive(const std::optional<double>& x, const char* option) {
  if (x && !(*x > 0 && std::isfinite(*x)))
    throw Error(fmt::format("{} must be a positive number, found {}.", option, *x));
}

}  // namespace

Setup::Setup(const CommonOptions& options, Purpose purpose) : scene(load_scene(options)) {
  noticed = take_notices();
  for (const auto& sentence : noticed) notice(sentence);  // should it fail before there is a summary
  require_single_run(scene);
  chosen_by(!options.parameters.empty(), "--parameters", "run.parameters",
            [&] { problem = make_problem(scene, options.parameters); });
  rho = problem.parameters.values();
  choose_solver(options);
  check_combination(options, purpose);
  files = !options.no_files;
  directory_chosen = !options.output.empty();
  directory = directory_chosen ? options.output
                               : std::filesystem::path("results") / std::filesystem::path(options.scene).stem();
  if (files && directory_chosen) chosen_by(true, "--output", "", [&] { require_writable(directory); });
  progress_options.quiet = options.quiet || options.json;
  progress_options.verbose = options.verbose;
}

void Setup::choose_solver(const CommonOptions& options) {
  require_positive(options.rtol, "--rtol");
  require_positive(options.atol, "--atol");
  require_positive(options.step, "--step");
  if (options.rtol && *options.rtol >= 1) throw Error(fmt::format("--rtol must be below 1, found {}.", *options.rtol));
  if (options.atol && *options.atol >= 1)
    throw Error(fmt::format("--atol must be below 1 (in SI units, of every unknown), found {}.", *options.atol));
  if (options.atol && *options.atol < kLeastAtol)
    throw Error(fmt::format("--atol must be at least {}, found {}.", kLeastAtol, *options.atol));
  if (options.checkpoint_steps && *options.checkpoint_steps < 0)
    throw Error(fmt::format("--checkpoint-steps must not be negative, found {}.", *options.checkpoint_steps));
  for (const auto& [key, x] : options.formulation_numbers) {
    if (!x) continue;
    const FormulationOption& o = find_formulation_option(key);
    std::string wrong = o.objection(*x);
    // A zero that stands for the formulation's own choice is what leaving the option out means.
    if (wrong.empty() && *x == 0 && o.number == 0 && o.rule == NumberRule::non_negative) wrong = "must be positive";
    if (!wrong.empty()) throw Error(fmt::format("{} {}, found {}.", o.flag, wrong, *x));
    problem.formulation_options.set(key, *x);
  }
  for (const auto& [key, word] : options.formulation_words)
    if (!word.empty()) problem.formulation_options.set(key, word);
  SolverOptions& solver = problem.solver;
  if (options.t_end) solver.t_end = *options.t_end;
  if (!std::isfinite(solver.t_end))
    throw Error(fmt::format("--t-end: The end time must be finite, found {} s.", solver.t_end));
  if (!(solver.t_end > solver.t_start))
    throw Error(
        fmt::format("--t-end: The end time {} s must lie after the start time {} s.", solver.t_end, solver.t_start));
  if (!(solver.t_end - solver.t_start > 1e-12 * std::max(std::abs(solver.t_start), std::abs(solver.t_end))))
    throw Error(fmt::format(
        "--t-end: The end time {} s is so near the start time {} s that there are hardly numbers between them.",
        solver.t_end, solver.t_start));
  // An explicit rtol moves the absolute tolerance along unless that is given, too.
  if (options.rtol) solver.set_rtol(*options.rtol);
  if (options.atol) solver.atol = *options.atol;
  if (!options.integrator.empty()) solver.integrator = options.integrator;
  if (!options.cvodes_method.empty()) solver.cvodes_method = options.cvodes_method;
  if (solver.cvodes_method != "adams" && solver.cvodes_method != "bdf")
    throw Error(fmt::format("--cvodes-method must be adams or bdf, found '{}'.", solver.cvodes_method));
  const std::string& corrector = options.sensitivity_corrector;
  if (!corrector.empty() && corrector != "staggered" && corrector != "simultaneous")
    throw Error(fmt::format("--sensitivity-corrector must be staggered or simultaneous, found '{}'.", corrector));
  if (!corrector.empty()) solver.staggered = corrector == "staggered";
  if (options.step) solver.step_s = *options.step;
  if (options.checkpoint_steps) solver.checkpoint_steps = *options.checkpoint_steps;
}

namespace {
void require_fixed_steps(const std::string& integrator) {
  if (!has_fixed_steps(integrator))
    throw Error(
        fmt::format("--step: '{}' chooses its own steps, by --rtol. Leave this option out, or take --integrator fixed "
                    "(of formulation "
                    "index3); [run] max_step_s bounds steps.",
                    integrator));
}
}  // namespace

void Setup::check_combination(const CommonOptions& options, Purpose purpose) {
  const bool formulation_chosen = !options.formulation.empty(), method_chosen = !options.method.empty(),
             integrator_chosen = !options.integrator.empty();
  if (formulation_chosen) problem.formulation = options.formulation;
  method = method_chosen ? options.method : scene.run.method;
  chosen_by(formulation_chosen, "--formulation", "run.formulation", [&] { find_formulation(problem.formulation); });
  chosen_by(method_chosen, "--method", "run.method", [&] { find_sensitivity_method(method); });
  chosen_by(integrator_chosen, "--integrator", "run.integrator", [&] { integrator_of(problem); });
  if (purpose == Purpose::compare) return;
  const Formulation& f = find_formulation(problem.formulation);
  // Another formulation than the scene's may need another method or integrator than the scene's.
  if (formulation_chosen && !integrator_chosen && !carries(f, problem.solver.integrator))
    problem.solver.integrator = "";
  if ((formulation_chosen || !scene.run.method_given) && !method_chosen && purpose == Purpose::differentiate)
    method = method_for(f, method);
  const std::string& integrator = problem.solver.integrator;
  chosen_by(integrator_chosen || formulation_chosen, integrator_chosen ? "--integrator" : "--formulation",
            "run.integrator", [&] {
              if (!integrator.empty()) require_form(problem, find_integrator(integrator));
            });
  if (purpose == Purpose::simulate) {
    if (options.step) require_fixed_steps(integrator_of(problem));
    return;
  }
  const SensitivityMethod& m = find_sensitivity_method(method);
  if (options.checkpoint_steps && !m.keeps_checkpoints) {
    std::vector<std::string> others;
    for (const auto& other : sensitivity_methods())
      if (other.keeps_checkpoints) others.push_back(other.name);
    throw Error(
        fmt::format("--checkpoint-steps: Method '{}' keeps no checkpoints; {} do. Leave this option out, or choose "
                    "one of these.",
                    method, fmt::join(others, ", ")));
  }
  chosen_by(method_chosen || formulation_chosen, method_chosen ? "--method" : "--formulation", "run.method", [&] {
    const std::string no = refusal(m, f);
    if (!no.empty()) throw CapabilityError(no);
  });
  const std::vector<std::string> own = integrators_of(m, f);
  if (integrator_chosen && !own.empty() && std::find(own.begin(), own.end(), integrator) == own.end())
    throw Error(
        fmt::format("--integrator: Method '{}' runs on {}, found '{}'; leave this option out, or choose "
                    "another method.",
                    method, fmt::join(own, " or "), integrator));
  if (options.step) require_fixed_steps(integrator_of(problem, m));
}

void require_writable(const std::filesystem::path& directory) {
  namespace fs = std::filesystem;
  std::error_code code;
  fs::path there = fs::absolute(directory, code);
  while (there.has_relative_path() && fs::status(there, code).type() == fs::file_type::not_found)
    there = there.parent_path();
  const fs::file_status status = fs::status(there, code);
  std::string why;
  if (fs::exists(status) && !fs::is_directory(status))
    why = fmt::format("'{}' is not a directory", there.string());
  else if (::access(there.c_str(), W_OK | X_OK) != 0)
    why = fmt::format("'{}': {}", there.string(), std::generic_category().message(errno));
  if (!why.empty())
    throw Error(
        fmt::format("Nothing can be written to '{}' ({}). Choose another directory with --output, or "
                    "--no-files.",
                    directory.string(), why));
}

bool Setup::write_file(const std::string& name, const std::function<void(const std::filesystem::path&)>& write) const {
  if (!files) return false;
  try {
    write(directory / name);
    return true;
  } catch (const Error& e) {
    if (directory_chosen) throw;
    print_message(fmt::format("warning: {}. Choose a directory with --output, or --no-files.", e.what()));
    return false;
  }
}

}  // namespace costate::app
