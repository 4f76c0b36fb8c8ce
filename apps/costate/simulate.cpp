// costate simulate: one run, its trajectory as HDF5 (and CSV), its summary as JSON.
#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "command.h"
#include "costate/integrator/simulate.h"
#include "costate/record/atomic_file.h"
#include "report_page.h"
#include "trajectory.h"

namespace costate::app {

namespace {

struct SimulateOptions {
  std::optional<double> step;
  bool csv = false, report = false;
};

int run(const CommonOptions& common, const SimulateOptions& options) {
  Setup setup(common, Purpose::simulate);
  setup.method.clear();
  if (options.report && !setup.files) throw Error("--report writes a page beside the trajectory, so it excludes --no-files.");
  Progress progress(setup.progress_options);
  const auto begin = std::chrono::steady_clock::now();
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  TrajectoryRecorder recorder(setup, options.step, !setup.files);
  const GradientResult r = setup.located(
      [&] { return simulate(setup.problem, setup.rho, recorder.times(), recorder.sink()); });
  progress.finish();
  const double wall = seconds_since(begin);
  Json j = run_json(setup, r, "", wall);
  j["terminal"] = recorder.terminal();
  std::string files;
  if (setup.files) {
    const TrajectoryTable table = recorder.finish(j);
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
  text += fmt::format("  {} on {}, rtol {:g}, t = {:g} .. {:g} s\n", setup.problem.formulation, r.integrator,
                      setup.problem.solver.rtol, setup.problem.solver.t_start, setup.problem.solver.t_end);
  text += fmt::format("  psi = {:.12g}\n  {} steps, {} residuals, {} factorizations, {:.3g} s\n", r.psi,
                      r.counters.steps, r.counters.residuals, r.counters.factorizations, wall);
  text += files;
  report(setup, common, j, text, "simulate.json");
  return 0;
}

}  // namespace

void add_simulate(CLI::App& app, std::function<int()>& action, CommonOptions& common) {
  CLI::App* c = app.add_subcommand("simulate", "Run a scene and store its trajectory");
  auto options = std::make_shared<SimulateOptions>();
  common.add_to(*c);
  common.add_run_options(*c);
  c->add_option("--output-step", options->step, "Time between stored samples [s]");
  c->add_flag("--csv", options->csv, "Write the trajectory as CSV too");
  c->add_flag("--report", options->report, "Write simulate.html too, a page with plots of the outputs that matter");
  c->callback([&action, &common, options] { action = [&common, options] { return run(common, *options); }; });
}

}  // namespace costate::app
