#include "adversary/fuzz_targets.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <regex>
#include <sstream>

#include "baseline.h"
#include "command_line.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/record/csv_file.h"
#include "costate/record/journal.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "optimize_journal.h"
#include "study/study_file.h"

namespace costate::fuzz {

namespace fs = std::filesystem;

namespace {

constexpr int kMostCoordinates = 60;  // of what is run

/// Is thrown by a target whose input reads as something else than it was.
struct Wrong {
  std::string what;
};

struct Course {
  const char *formulation, *method;
};
const Course kCourses[] = {{"baumgarte", "cvodes-adjoint"}, {"index1", "idas-adjoint"},
                           {"maggi", "cvodes-forward"},     {"index2", "idas-forward"},
                           {"penalty", "cvodes-adjoint"},   {"index3", "discrete-adjoint"},
                           {"baumgarte", "hand-tangent"},   {"augmented-lagrangian", "cvodes-adjoint"},
                           {"baumgarte", "hand-adjoint"},   {"maggi-implicit", "idas-adjoint"}};

/// Up to two numbers that may vary, besides the scene's parameters.
std::vector<std::string> varied(const Scene& scene, long index) {
  std::vector<std::string> names = scene.run.parameters;
  if (names.size() > 3) names.resize(3);
  const auto& numbers = scene.mechanism()->numbers();
  for (std::size_t k = 0; k < 2 && !numbers.empty() && names.empty(); ++k) {
    const auto at = (static_cast<std::size_t>(index) * 7 + k * 13) % numbers.size();
    if (numbers[at].fixed_because.empty()) names.push_back(numbers[at].path);
  }
  return names;
}

/// A few steps, and for every third input a gradient. Whether it came to its end.
bool run(const Scene& scene, long index) {
  if (scene.mechanism()->coordinate_count() > kMostCoordinates) return false;
  try {
    const bool gradient_too = index % 3 == 0;
    Problem problem = make_problem(scene, gradient_too && index % 2 == 0 ? varied(scene, index) : scene.run.parameters);
    const Course& course = kCourses[static_cast<std::size_t>(index / 3) % std::size(kCourses)];
    problem.formulation = gradient_too ? course.formulation : "baumgarte";
    problem.solver.integrator = "";
    problem.solver.t_end = problem.solver.t_start + 1e-3;
    if (!(problem.solver.t_end > problem.solver.t_start)) return false;
    problem.solver.rtol = 1e-6;
    problem.solver.atol = 0;
    problem.solver.step_s = 0;
    problem.solver.max_steps = 500;
    std::vector<double> values;
    double psi = 0;
    if (gradient_too) {
      const GradientResult g = gradient(problem, course.method, problem.parameters.values());
      values = g.gradient;
      psi = g.psi;
    } else {
      psi = simulate(problem, problem.parameters.values()).psi;
    }
    values.push_back(psi);
    for (const double x : values)
      if (!std::isfinite(x)) throw Wrong{"psi or its gradient is not finite, without an error"};
    return true;
  } catch (const SolverError& e) {  // a run may fail, with a cause
    if (is_raw(e.what())) throw;
    return false;
  } catch (const CapabilityError& e) {  // or refuse
    if (is_raw(e.what())) throw;
    return false;
  } catch (const ModelError& e) {  // as the tool reports it
    throw scene.located(e);
  }
}

void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

/// Reads a scene and runs it.
Verdict scene_target(const std::string& text, const std::string& name, long index,
                     const std::vector<std::string>& overrides = {}) {
  const Scene scene = Scene::parse(text, name, overrides);
  return run(scene, index) ? Verdict::ran : Verdict::read;
}

Verdict study_target(const fs::path& file) {
  const app::Study study = app::read_study(file.string(), {});
  for (const app::StudyRun& r : study.runs) {
    app::CommandLine line;
    std::vector<std::string> words = {"optimize", r.scene.string()};
    words.insert(words.end(), r.options.begin(), r.options.end());
    try {
      line.parse(words);
    } catch (const app::UsageError& e) {
      throw Error(fmt::format("{}: the run '{}': {}", file.string(), r.name, e.what()));
    }
  }
  return Verdict::read;
}

/// The journal must be refused or begin with records as they were written: nothing is half believed.
Verdict journal_target(const fs::path& file, const std::string& text) {
  static const std::string original = journal_text();
  const auto lines = [](const std::string& s) {
    std::vector<std::string> r;
    std::istringstream in(s);
    for (std::string l; std::getline(in, l);) r.push_back(l);
    return r;
  };
  const nlohmann::json header = nlohmann::json::parse(lines(original)[0]).at("header");
  ParameterSelection selection;
  for (const char* name : {"m", "x"}) {
    Parameter p;
    p.name = name;
    p.lower = -1;
    p.upper = 10;
    selection.parameters.push_back(p);
  }
  Journal journal = Journal::open(file, header, true);
  const auto found = app::read_evaluations(journal, selection, 1, 0);
  const auto mutated = lines(text), written = lines(original);
  for (std::size_t i = 0; i < found.size(); ++i) {
    nlohmann::json record = nlohmann::json::parse(written.at(i + 1)), again = app::evaluation_record(found[i]);
    record.erase("checksum");
    if (found[i].failed()) again["psi"] = "nan";  // what is not finite is stored as text
    if (record != again) throw Wrong{fmt::format("record {} is believed though it was not written so", i + 1)};
  }
  if (!journal.damage().empty() && is_raw(journal.damage())) throw Error(journal.damage());
  return found.empty() ? Verdict::read : Verdict::ran;
}

Verdict read_input(const Input& input, long index, const fs::path& directory) {
  using Kind = Input::Kind;
  const fs::path file = directory / file_of(input.kind);
  const bool is_scene = input.kind == Kind::scene || input.kind == Kind::over;
  if (!is_scene) write(file, input.text);
  switch (input.kind) {
    case Kind::scene:
      return scene_target(input.text, (fs::path(input.folder) / "fuzz.toml").string(), index);
    case Kind::tyre:
      return scene_target(std::string(kWheel) +
                              "[road.plain]\nkind = \"flat\"\n[tyre.T]\nwheel = \"hub\"\nroad = \"plain\"\n"
                              "stiffness_N_per_m = 1.6e5\nmodel = \"magic_formula\"\ntir_file = \"" +
                              file.string() + "\"\n",
                          "fuzz.toml", index);
    case Kind::profile:
      return scene_target(
          std::string(kWheel) + "[road.rough]\nkind = \"profile\"\nlaw = { kind = \"profile_table\", file = \"" +
              file.string() +
              "\" }\n[tyre.T]\nwheel = \"hub\"\nroad = \"rough\"\nradius_m = 0.2\nstiffness_N_per_m = 1.6e5\n"
              "model = \"ride\"\n",
          "fuzz.toml", index);
    case Kind::include:
      return scene_target("include = [\"" + file.string() +
                              "\"]\nremove = [\"spring.*\"]\n[start]\ngiven = [\"P.x\"]\n[point.P]\nx_m = 0.5\n",
                          "fuzz.toml", index);
    case Kind::over: {
      std::vector<std::string> overrides;
      std::istringstream in(input.text);
      // One or two of them, else the first wrong one would hide all others.
      std::vector<std::string> all;
      for (std::string l; std::getline(in, l);)
        if (l.find('=') != std::string::npos && l.find('=') > 0) all.push_back(l);
      if (all.empty()) return Verdict::read;
      for (std::size_t k = 0; k < 2; ++k)
        overrides.push_back(all[(static_cast<std::size_t>(index) + 3 * k) % all.size()]);
      return scene_target(std::string(kPendulum) + "[run]\nt_end_s = 1\n", "fuzz.toml", index, overrides);
    }
    case Kind::study:
      write(directory / "fuzz_scene.toml",
            std::string(kPendulum) + "[run]\nt_end_s = 1\nparameters = [\"m\", \"x\"]\n");
      return study_target(file);
    case Kind::baseline:
      app::Baseline::load(file);
      return Verdict::read;
    case Kind::journal:
      return journal_target(file, input.text);
    case Kind::csv:
      static_cast<void>(read_csv(file));
      return Verdict::read;
    case Kind::crg:
      return scene_target(std::string(kWheel) + "[data.R]\nfile = \"" + file.string() +
                              "\"\n[road.rough]\nkind = \"profile\"\nlaw = { kind = \"data\", data = \"R\", column = "
                              "\"v=0.5\", beyond = \"hold\" }\n[tyre.T]\nwheel = \"hub\"\nroad = \"rough\"\nradius_m = "
                              "0.2\nstiffness_N_per_m = 1.6e5\nmodel = \"ride\"\n",
                          "fuzz.toml", index);
  }
  return Verdict::read;
}

}  // namespace

bool names_a_place(const std::string& message) {
  // file:line, file and key, or the element by its path or name.
  static const std::regex place(R"([\w/.-]+\.(toml|tir|txt|json|jsonl|csv|crg)(:\d+:\d+|'|:))"),
      override(R"(override ')");
  return std::regex_search(message, place) || std::regex_search(message, override);
}

bool is_raw(const std::string& message) {
  for (const char* words : {"json.exception", "std::", "basic_string", "bad_alloc", "vector::", "map::at", "stod",
                            "toml::", "Error while parsing", "parse error", "assert", "Eigen"})
    if (message.find(words) != std::string::npos) return true;
  for (const char c : message)
    if (c == '\0') return true;
  return false;
}

Outcome try_input(const Input& input, long index, const fs::path& directory) {
  try {
    const Verdict v = read_input(input, index, directory);
    for (const std::string& n : take_notices())
      if (is_raw(n)) return {Verdict::raw, n};
    return {v, ""};
  } catch (const Wrong& e) {
    return {Verdict::wrong, e.what};
  } catch (const Error& e) {
    const std::string what = e.what();
    take_notices();
    return {is_raw(what) ? Verdict::raw : names_a_place(what) ? Verdict::refused : Verdict::placeless, what};
  } catch (const std::exception& e) {
    return {Verdict::raw, e.what()};
  }
}

}  // namespace costate::fuzz
