// costate simulate: one run, its trajectory as HDF5 (and CSV), its summary as JSON.
#include "costate/integrator/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "accuracy.h"
#include "command.h"
#include "costate/base/notice.h"
#include "costate/objective/output.h"
#include "costate/record/atomic_file.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/tradeoff/motion_confirmation.h"
#include "digits.h"
#include "events_text.h"
#include "report_page.h"
#include "start_notice.h"
#include "trajectory.h"

namespace costate::app {

namespace {

struct SimulateOptions {
  std::optional<double> step;
  std::vector<std::string> outputs;
  bool csv = false, report = false, estimate = false, single = false;
  AccuracyOption accuracy;
};

// On a stiff motion an integrator by differentiation formulas may try every step twice and never get on by longer ones.
std::string tries_text(const Simulation& r) {
  constexpr long kMany = 1000;
  const Counters& c = r.counters;
  const bool implicit = r.integrator == "idas" || r.integrator == "cvodes";
  if (!implicit || c.steps < kMany || 2 * c.error_test_failures < c.steps) return "";
  return fmt::format(
      "  {} of these steps were tried once more with a shorter one: stiff for {}; --integrator radau9 may take far "
      "fewer\n",
      c.error_test_failures, r.integrator);
}

int run(const CommonOptions& common, const SimulateOptions& options) {
  Setup setup(common, Purpose::simulate);
  setup.method.clear();
  if (options.report && !setup.files)
    throw Error("--report writes a page beside the trajectory, so it excludes --no-files.");
  if (options.report && !options.outputs.empty())
    throw Error("--report shows the whole motion, so it excludes --outputs, which stores a part of it.");
  for (const std::string& name : options.outputs) make_output(*setup.problem.mechanism, name);
  Progress progress(setup.progress_options);
  const auto begin = std::chrono::steady_clock::now();
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  setup.problem.solver.confirm = !options.single;
  std::optional<TrajectoryRecorder> recording;
  const auto record = [&] {
    recording.emplace(setup, setup.rho, options.step, !setup.files, options.outputs);
    return TradeProbe::Recording{recording->times(), recording->sink()};
  };
  const auto accuracy = options.accuracy.asked(setup, common);
  std::optional<AccurateRun> accurate;
  const bool all = options.outputs.empty() && (setup.files || common.json);
  if (accuracy)
    accurate = run_accurately(setup, common, *accuracy, false, {options.outputs, all},
                              [&](const Problem&) { return record(); });
  const Simulation r = accurate ? accurate->result : started(setup, [&] {
    const auto& outputs = options.outputs.empty() ? setup.scene.run.outputs : options.outputs;
    return confirmed_simulation(setup.problem, setup.rho, record(),
                                all ? all_that_is_told(setup.problem, setup.rho, outputs) : outputs);
  });
  TrajectoryRecorder& recorder = *recording;
  const double wall = seconds_since(begin);
  const Objective& objective = setup.problem.objective;
  const bool costs = !objective.running.empty() || !objective.terminal.empty();
  std::optional<double> error;
  if (accurate)
    error = accurate->psi_error;
  else if (options.estimate && costs)
    if (const auto e = estimate_or_tell(
            [&] { return setup.located([&] { return estimate_error(setup.problem, setup.rho, r); }); }))
      error = e->psi;
  progress.finish();
  for (const auto& remark : not_finite_remarks(recorder.table())) notice(remark);
  if (setup.files || common.json) recorder.tell_of_open_reactions();
  Json j = run_json(setup, GradientResult(r), "", wall);
  const std::optional<double> known = costs ? psi_error_of(error, r.known_error) : error;
  j["psi_error"] = known ? Json(*known) : Json();
  if (accurate) j["accuracy"] = accuracy_json(*accurate, *accuracy);
  j["terminal"] = recorder.terminal();
  j["units"] = recorder.units();
  std::string files;
  if (setup.files) {
    const TrajectoryTable table = recorder.finish(j, r);
    j["files"] = Json::array();
    for (const auto& path : write_trajectory(setup, table, "trajectory", options.csv)) {
      j["files"].push_back(path);
      files += fmt::format("  trajectory: {}\n", path);
    }
    if (options.report && setup.write_file("simulate.html", [&](const auto& path) {
          write_file_atomically(path, simulate_page(setup, j, table));
        })) {
      j["files"].push_back((setup.directory / "simulate.html").string());
      files += fmt::format("  report: {}\n", j["files"].back().get<std::string>());
    }
  }
  std::string text = fmt::format("{}\n", setup.scene.title.empty() ? common.scene : setup.scene.title);
  const SolverOptions& solver = setup.problem.solver;
  const Precision precision = precision_of(solver, r.integrator, r.counters.steps);
  text += fmt::format("  {} on {}, {}, t = {:g} .. {:g} s\n", setup.problem.formulation, r.integrator, precision.run,
                      solver.t_start, r.end ? r.end->t : solver.t_end);
  text += fmt::format("  {}\n",
                      costs ? psi_text(r.psi, precision, error, r.known_error) : "psi = 0 (the scene has no cost)");
  if (accurate) text += accuracy_text(*accurate, *accuracy);
  text += events_text(r, times_uncertainty(solver, precision, accurate ? &*accurate : nullptr));
  text += fmt::format("  {} steps, {} residuals, {} factorizations, {:.3g} s\n", r.counters.steps, r.counters.residuals,
                      r.counters.factorizations, wall);
  text += tries_text(r);
  text += files;
  report(setup, common, j, text, "simulate.json");
  return accurate && !accurate->met ? kFailed : 0;
}

}  // namespace

const RegisterCommand simulate_command(
    CommandGroup::run, "simulate", "Run a scene and store its trajectory", [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<SimulateOptions>();
      common.add_to(c);
      common.add_run_options(c);
      options->accuracy.add_to(c);
      c.option("--output-step", options->step, "Time between stored samples [s]");
      c.option("--outputs", options->outputs,
               "Store these alone, separated by commas: P.x, P.x_dot, P.x_ddot, lambda.ROW, z.STATE, any output")
          .separated();
      c.flag("--csv", options->csv, "Write the trajectory as CSV too");
      c.flag("--report", options->report, "Write simulate.html too, a page with plots of the outputs that matter");
      c.flag("--estimate-error", options->estimate,
             "Estimate psi's error by a rerun at rtol/10 or less, or half the step");
      c.flag("--no-confirm", options->single, "One run, without the looser or tighter one that confirms it");
      c.runs([&common, options] { return run(common, *options); });
    });

}  // namespace costate::app
