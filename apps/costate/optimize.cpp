// costate optimize: L-BFGS (MMA, SLSQP) on a scene's cost; journalled so that an interrupted run resumes exactly.
#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "command.h"
#include "costate/base/error.h"
#include "costate/optimize/certificate.h"
#include "costate/optimize/optimizer.h"
#include "costate/record/atomic_file.h"
#include "costate/record/interrupt.h"
#include "costate/record/journal.h"
#include "costate/record/json_number.h"
#include "report_page.h"
#include "trajectory.h"

namespace costate::app {

namespace {

struct OptimizeOptions {
  bool resume = false, no_certificate = false, no_report = false;
  std::optional<int> max_evaluations;
  std::optional<double> stop_value;
  std::string algorithm;
};

nlohmann::json to_record(const OptimizerEvaluation& e) {
  nlohmann::json j;
  j["index"] = e.index;
  j["parameters"] = e.rho;
  j["psi"] = e.psi;
  j["gradient"] = e.gradient;
  j["constraints"] = e.constraints;
  j["constraint_gradients"] = e.constraint_gradients;
  j["projected_gradient"] = e.projected_gradient;
  for (const auto& [name, value] : counter_list(e.counters)) j["counters"][name] = value;
  j["wall_s"] = e.wall_s;
  return j;
}

OptimizerEvaluation from_record(const nlohmann::json& j) {
  OptimizerEvaluation e;
  e.index = j.at("index").get<int>();
  e.rho = numbers_from_json(j.at("parameters"));
  e.psi = number_from_json(j.at("psi"));
  e.gradient = numbers_from_json(j.at("gradient"));
  e.constraints = numbers_from_json(j.at("constraints"));
  for (const auto& g : j.at("constraint_gradients")) e.constraint_gradients.push_back(numbers_from_json(g));
  e.projected_gradient = number_from_json(j.at("projected_gradient"));
  e.wall_s = number_from_json(j.at("wall_s"));
  Counters& c = e.counters;
  long* const fields[] = {&c.steps, &c.residuals, &c.jacobians, &c.newton_iterations, &c.error_test_failures,
                          &c.convergence_failures, &c.backward_steps, &c.backward_residuals, &c.backward_jacobians,
                          &c.backward_newton_iterations, &c.backward_error_test_failures,
                          &c.backward_convergence_failures, &c.sensitivity_residuals, &c.factorizations,
                          &c.checkpoints, &c.simulations, &c.jumps, &c.position_iterations};
  const auto names = counter_list(c);
  for (std::size_t i = 0; i < names.size(); ++i) *fields[i] = j.at("counters").value(names[i].first, 0L);
  return e;
}

Json evaluation_json(const OptimizerEvaluation& e, const std::vector<std::string>& names,
                     const std::vector<OptimizerConstraint>& constraints) {
  Json j;
  j["index"] = e.index;
  j["parameters"] = named(names, e.rho);
  j["psi"] = e.psi;
  j["gradient"] = named(names, e.gradient);
  if (!constraints.empty()) {
    j["constraints"] = Json::object();
    for (std::size_t c = 0; c < constraints.size(); ++c) j["constraints"][constraints[c].name] = e.constraints[c];
  }
  j["projected_gradient"] = e.projected_gradient;
  j["counters"] = counters_json(e.counters);
  j["wall_s"] = e.wall_s;
  return j;
}

/// The evaluations of an interrupted run.
std::vector<OptimizerEvaluation> evaluations_of(const Journal& journal) {
  std::vector<OptimizerEvaluation> evaluations;
  for (const auto& r : journal.records()) try {
      evaluations.push_back(from_record(r));
    } catch (const std::exception& e) {
      throw Error(fmt::format("Record {} of the journal '{}' is damaged: {}. Start without --resume.",
                              evaluations.size() + 1, journal.path().string(), e.what()));
    }
  return evaluations;
}

std::string evaluation_line(const OptimizerEvaluation& e, const std::vector<std::string>& names, bool verbose) {
  std::string line = fmt::format("  {:>4}  psi = {:<18.12g} |projected gradient| = {:<10.3g}", e.index, e.psi,
                                 e.projected_gradient);
  for (std::size_t j = 0; j < names.size() && j < 6; ++j) line += fmt::format(" {} = {:.9g}", names[j], e.rho[j]);
  if (names.size() > 6) line += " ...";
  if (verbose)
    line += fmt::format(" steps = {} + {} backward, {:.3g} s", e.counters.steps, e.counters.backward_steps, e.wall_s);
  if (e.replayed) line += " (from the journal)";
  return line;
}

/// The motion at given parameters, written as trajectory files.
TrajectoryTable write_motion(const Setup& setup, const std::vector<double>& rho, const std::string& name,
                             const Json& settings) {
  TrajectoryRecorder recorder(setup, std::nullopt);
  simulate(setup.problem, rho, recorder.times(), recorder.sink());
  TrajectoryTable table = recorder.finish(settings);
  write_trajectory(setup, table, name, true);
  return table;
}

/// The scene's settings with the command line's, checked before anything is computed or written.
OptimizerOptions optimizer_options(const Setup& setup, const OptimizeOptions& options) {
  const OptimizeSettings& s = setup.scene.optimize;
  OptimizerOptions o;
  o.algorithm = !options.algorithm.empty() ? options.algorithm : s.algorithm;
  o.max_evaluations = options.max_evaluations.value_or(s.max_evaluations);
  o.stop_value = options.stop_value ? *options.stop_value : s.stop_value.value_or(o.stop_value);
  o.relative_tolerance = s.relative_tolerance;
  o.gradient_tolerance = s.gradient_tolerance;
  setup.chosen_by(!options.algorithm.empty(), "--algorithm", "optimize.algorithm",
                  [&] { require_algorithm(o.algorithm, !setup.scene.constraints().empty()); });
  setup.chosen_by(options.max_evaluations.has_value(), "--max-evaluations", "optimize.max_evaluations", [&] {
    if (o.max_evaluations < 1)
      throw Error(fmt::format("At least one evaluation is needed, found {}.", o.max_evaluations));
  });
  if (std::isnan(o.stop_value)) throw Error("--stop-value must be a number, found nan.");
  if (setup.problem.parameters.size() == 0)
    throw Error("There is no parameter to optimize: name some with --parameters or in [run].");
  if (options.resume && !setup.files) throw Error("--resume reads the journal of the run, so it excludes --no-files.");
  return o;
}

Json certificate_json(const Certificate& c, double wall_s) {
  Json j;
  j["verdict"] = c.verdict;
  j["projected_gradient"] = c.projected_gradient;
  j["kkt_residual"] = c.kkt_residual;
  j["kkt_tolerance"] = c.tolerance;
  j["active"] = c.active;
  j["free"] = c.free;
  j["multipliers"] = Json::object();
  for (const auto& [name, value] : c.multipliers) j["multipliers"][name] = value;
  const bool hessian = !c.formulation.empty(), any = !c.eigenvalues.empty(), definite = c.newton_step >= 0;
  j["hessian_formulation"] = hessian ? Json(c.formulation) : Json();
  j["hessian_note"] = c.note.empty() ? Json() : Json(c.note);
  j["hessian_eigenvalues"] = hessian ? Json(c.eigenvalues) : Json();
  j["smallest_eigenvalue"] = any ? Json(c.eigenvalues.front()) : Json();
  j["largest_eigenvalue"] = any ? Json(c.eigenvalues.back()) : Json();
  j["condition"] = definite ? Json(c.eigenvalues.back() / c.eigenvalues.front()) : Json();
  j["eigenvalue_tolerance"] = hessian ? Json(c.curvature_tolerance) : Json();
  j["newton_step"] = definite ? Json(c.newton_step) : Json();
  j["predicted_decrease"] = definite ? Json(c.predicted_decrease) : Json();
  j["hessian_asymmetry"] = hessian ? Json(c.asymmetry) : Json();
  j["wall_s"] = wall_s;
  return j;
}

std::string certificate_text(const Certificate& c) {
  std::string text = fmt::format("  {}\n", c.verdict);
  for (const auto& [name, value] : c.multipliers)
    text += fmt::format("  {} is active: multiplier {:.6g}\n", name, value);
  if (c.eigenvalues.size() == 1) text += fmt::format("  Hessian in scaled parameters: {:.6g}\n", c.eigenvalues[0]);
  if (c.eigenvalues.size() > 1)
    text += fmt::format("  Hessian in scaled parameters: eigenvalues {:.6g} to {:.6g}\n", c.eigenvalues.front(),
                        c.eigenvalues.back());
  if (c.newton_step >= 0)
    text += fmt::format("  Newton's step from here: {:.3g} of the scales, psi would fall by {:.3g}\n", c.newton_step,
                        c.predicted_decrease);
  if (!c.note.empty()) text += fmt::format("  {}\n", c.note);
  return text;
}

/// Everything that decides the sequence of evaluations.
nlohmann::json journal_header(const Setup& setup, const OptimizerOptions& o) {
  nlohmann::json header;
  header["scene"] = setup.scene.dump();
  header["parameters"] = setup.problem.parameters.names();
  header["formulation"] = setup.problem.formulation;
  header["method"] = setup.method;
  header["settings"] = nlohmann::json(settings_json(setup));
  header["settings"].erase("scene");
  header["settings"]["rtol"] = setup.problem.solver.rtol;
  header["settings"]["integrator"] = setup.problem.solver.integrator;
  header["optimize"] = {{"algorithm", o.algorithm},
                        {"stop_value", with_nonfinite_as_text(o.stop_value)},
                        {"relative_tolerance", o.relative_tolerance},
                        {"gradient_tolerance", o.gradient_tolerance}};
  return header;
}

int run(const CommonOptions& common, const OptimizeOptions& options) {
  Setup setup(common, Purpose::differentiate);
  const auto names = setup.problem.parameters.names();
  const OptimizerOptions o = optimizer_options(setup, options);
  std::vector<OptimizerConstraint> constraints;
  for (const auto& c : setup.scene.constraints()) constraints.push_back({c.name, c.objective, c.upper});

  std::optional<Journal> journal;
  std::vector<OptimizerEvaluation> replay;
  if (setup.files) {
    require_writable(setup.directory);
    journal.emplace(Journal::open(setup.directory / "evaluations.jsonl", journal_header(setup, o), options.resume));
    replay = evaluations_of(*journal);
  }

  Progress progress(setup.progress_options);
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  const auto begin = std::chrono::steady_clock::now();
  const bool lines = !common.json && !common.quiet && !common.take;
  if (lines && options.resume)
    fmt::print("resuming after {} evaluation{}\n", replay.size(), replay.size() == 1 ? "" : "s");
  const auto record = [&](const OptimizerEvaluation& e) {
    if (!e.replayed && static_cast<std::size_t>(e.index) <= replay.size())
      throw Error(fmt::format("Evaluation {} of the journal '{}' was made at other parameters than this run asks for: "
                              "it was written on another kind of machine. Start without --resume.", e.index,
                              journal->path().string()));
    if (journal && !e.replayed) journal->append(to_record(e));
    progress.finish();
    if (lines) {
      fmt::print("{}\n", evaluation_line(e, names, common.verbose));
      std::fflush(stdout);
    }
    throw_if_interrupted();
    progress.start(setup.problem.solver.t_start);
  };
  const OptimizerResult result =
      setup.located([&] { return optimize(setup.problem, setup.method, constraints, o, replay, record); });
  const double wall = seconds_since(begin);
  const OptimizerEvaluation &first = result.evaluations.front(), &best = result.evaluations[result.best];

  // Behind the last evaluation: an interruption here leaves the journal complete, and --resume comes straight back.
  std::optional<Certificate> certificate;
  const auto certificate_begin = std::chrono::steady_clock::now();
  if (!options.no_certificate)
    certificate = setup.located([&] { return certify(setup.problem, constraints, first, best); });
  const double certificate_wall = seconds_since(certificate_begin);

  const std::vector<double> initial = setup.rho;
  setup.rho = best.rho;
  GradientResult final;
  final.psi = best.psi;
  final.gradient = best.gradient;
  final.counters = best.counters;
  final.integrator = setup.method.rfind("idas", 0) == 0     ? "idas"
                     : setup.method.rfind("cvodes", 0) == 0 ? "cvodes"
                     : setup.method.rfind("discrete", 0) == 0 ? "fixed"
                                                            : integrator_of(setup.problem);
  Json j = run_json(setup, final, setup.method, wall);
  j["initial"] = {{"psi", first.psi}, {"parameters", named(names, first.rho)}, {"gradient", named(names, first.gradient)}};
  j["algorithm"] = o.algorithm;
  j["stop_reason"] = result.stop_reason;
  j["converged"] = result.converged;
  j["best_evaluation"] = best.index;
  j["bounds_active"] = Json::array();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Parameter& p = setup.problem.parameters.parameters[i];
    if (best.rho[i] == p.lower || best.rho[i] == p.upper) j["bounds_active"].push_back(names[i]);
  }
  if (certificate) j["certificate"] = certificate_json(*certificate, certificate_wall);
  j["evaluations"] = Json::array();
  for (const auto& e : result.evaluations) j["evaluations"].push_back(evaluation_json(e, names, constraints));

  setup.write_file("optimized.toml", [&](const auto& path) {
    write_file_atomically(path, setup.scene.with_parameters(setup.problem.parameters, best.rho).dump());
  });
  bool page = false;
  if (setup.files) {
    const TrajectoryTable before = write_motion(setup, initial, "before", j["settings"]),
                          after = write_motion(setup, best.rho, "after", j["settings"]);
    page = !options.no_report && setup.write_file("report.html", [&](const auto& path) {
      write_file_atomically(path, optimize_page(setup, j, before, after));
    });
  }
  progress.finish();
  std::string text = fmt::format("{}: psi {:.6g} -> {:.6g} in {} evaluations, {:.3g} s\n",
                                 setup.scene.title.empty() ? common.scene : setup.scene.title, first.psi, best.psi,
                                 result.evaluations.size(), wall);
  text += fmt::format("  stopped by {}\n", result.stop_reason);
  for (std::size_t i = 0; i < names.size(); ++i)
    text += fmt::format("  {:<16} {:>18.12g} -> {:.12g}\n", names[i], first.rho[i], best.rho[i]);
  if (certificate) text += certificate_text(*certificate);
  if (setup.files)
    text += fmt::format("  results in {}: evaluations.jsonl, optimized.toml, before.h5, after.h5 (and .csv)\n",
                        setup.directory.string());
  if (page) text += fmt::format("  report: {}\n", (setup.directory / "report.html").string());
  report(setup, common, j, text, "optimize.json");
  return 0;
}

}  // namespace

void add_optimize(CLI::App& app, std::function<int()>& action, CommonOptions& common) {
  CLI::App* c = app.add_subcommand("optimize", "Minimise the scene's cost over its parameters");
  auto options = std::make_shared<OptimizeOptions>();
  common.add_to(*c);
  common.add_run_options(*c);
  c->add_flag("--resume", options->resume, "Continue an interrupted run from its journal");
  c->add_flag("--no-certificate", options->no_certificate,
              "Leave out the check of the optimum: multipliers and the Hessian's eigenvalues");
  c->add_flag("--no-report", options->no_report, "Leave out report.html, the page with plots");
  c->add_option("--max-evaluations", options->max_evaluations, "Limit of evaluations");
  c->add_option("--stop-value", options->stop_value, "Stop once psi is this small");
  c->add_option("--algorithm", options->algorithm, "lbfgs, mma or slsqp");
  c->callback([&action, &common, options] { action = [&common, options] { return run(common, *options); }; });
}

}  // namespace costate::app
