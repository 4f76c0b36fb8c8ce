// costate tradeoff: what accuracy costs on this scene, measured: every formulation, integrator and tolerance or step
// (and gradient method) against a reference that is proven first.
#include <fmt/format.h>

#include <cmath>

#include "command.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/record/atomic_file.h"
#include "costate/record/interrupt.h"
#include "costate/record/jobs.h"
#include "guide.h"
#include "number_list.h"
#include "saving.h"
#include "tradeoff_levels.h"
#include "tradeoff_summary.h"
#include "trajectory.h"

namespace costate::app {

namespace {

struct TradeoffOptions {
  TradeOptions study;
  LevelOptions levels;
  std::vector<std::string> tolerances, steps;
  int jobs = 0;
};

class Tradeoff {
 public:
  Tradeoff(const CommonOptions& common, const TradeoffOptions& options)
      : common_(common), options_(options), setup_(common, Purpose::compare), progress_(told_lines(setup_)) {
    setup_.problem.monitor = monitor(progress_, setup_.problem.solver.t_end);
  }

  int run() {
    read_options();
    if (options_.levels.asked()) {
      run_levels();
    } else {
      set_jobs(options_.jobs);
      setup_.located([&] {
        TradeStudy study(setup_.problem, setup_.rho, options_.study);
        measure(study);
        finish(tradeoff_json(setup_, study), tradeoff_text(setup_, study), tradeoff_page(setup_, study, note_),
               tradeoff_csv(study));
      });
    }
    return interruption_ == 0 ? 0 : 128 + interruption_;
  }

 private:
  static ProgressOptions told_lines(const Setup& setup) {
    ProgressOptions o = setup.progress_options;
    o.verbose = true;
    return o;
  }

  template <class Study>
  void measure(Study& study) {
    study.tell = [this](const std::string& text) { progress_.line("  " + text); };
    study.find_reference();
    try {
      study.measure();
    } catch (const Interrupted& e) {
      interruption_ = e.signal_number();
      note_ = std::string(e.what()) + " What had been measured until then stands.";
    }
    progress_.finish();
  }

  /// Each scene's settings are its own, by accuracy.
  void run_levels() {
    const TradeOptions& o = options_.study;
    for (const auto& [given, name] :
         {std::pair(!o.formulations.empty(), "--formulations"), std::pair(!o.integrators.empty(), "--integrators"),
          std::pair(!o.methods.empty(), "--methods"), std::pair(!options_.tolerances.empty(), "--rtols"),
          std::pair(!options_.steps.empty(), "--steps"), std::pair(options_.jobs != 0, "--jobs")})
      if (given)
        throw Error(
            fmt::format("{} does not go with --levels: levels run one by one, each at the settings that are "
                        "cheapest for an accuracy of it.",
                        name));
    DetailLevels read = read_levels(common_, setup_, options_.levels, asked_outputs_, o.gradient);
    for (std::size_t level = 0; level < read.levels.size(); ++level) {
      const Setup& of_level = level == 0 ? setup_ : read.setups[level - 1];
      read.levels[level].problem.monitor = setup_.problem.monitor;
      read.levels[level].located = [&of_level](const std::function<void()>& f) { of_level.located(f); };
    }
    LevelStudy study(std::move(read.levels), {o.gradient, o.budget_s, o.repeats, o.samples});
    measure(study);
    finish(levels_json(setup_, study, read.notes), levels_text(setup_, study, read.notes),
           levels_page(setup_, study, read.notes, note_), levels_csv(study));
  }

  void read_options() {
    asked_outputs_ = options_.study.outputs;
    TradeOptions& o = options_.study;
    if (!(o.budget_s >= 0 && std::isfinite(o.budget_s)))
      throw Error(fmt::format("--budget must be a number of seconds, or 0 for no limit, found {}.", o.budget_s));
    if (o.repeats < 0 || o.repeats > 1000)
      throw Error(fmt::format("--repeats must lie between 0 and 1000, found {}.", o.repeats));
    if (!(o.patience > 0 && std::isfinite(o.patience)))
      throw Error(fmt::format("--patience must be a positive number, found {}.", o.patience));
    if (o.samples < 2 || o.samples > 100000)
      throw Error(fmt::format("--samples must lie between 2 and 100000, found {}.", o.samples));
    const auto in_order = [](std::vector<double>& x) { std::sort(x.rbegin(), x.rend()); };
    if (!options_.tolerances.empty()) {
      o.tolerances = read_numbers(
          "--rtols", options_.tolerances, [](double x) { return x > 0 && x < 1; }, "numbers between 0 and 1");
      in_order(o.tolerances);
    }
    if (!options_.steps.empty()) {
      o.steps = read_numbers(
          "--steps", options_.steps, [](double x) { return x > 0 && std::isfinite(x); }, "positive numbers [s]");
      in_order(o.steps);
    }
    setup_.chosen_by(true, "--formulations", "", [&] {
      for (const auto& name : o.formulations) find_formulation(name);
    });
    setup_.chosen_by(true, "--methods", "", [&] {
      for (const auto& name : o.methods) find_sensitivity_method(name);
    });
    setup_.chosen_by(true, "--integrators", "", [&] {
      for (const auto& name : o.integrators) {
        Problem p = setup_.problem;
        p.solver.integrator = name;
        integrator_of(p);
      }
    });
    const Objective& cost = setup_.problem.objective;
    if (o.gradient && cost.running.empty() && cost.terminal.empty())
      throw Error("--gradient: The scene has no cost that could be differentiated.");
    if (o.gradient && setup_.problem.parameters.size() == 0)
      throw Error("--gradient: There is no parameter to differentiate: name some with --parameters or in [run].");
    if (!o.methods.empty() && !o.gradient) throw Error("--methods goes with --gradient.");
    const Mechanism& m = *setup_.problem.mechanism;
    setup_.chosen_by(!o.outputs.empty(), "--outputs", "run.outputs", [&] {
      if (o.outputs.empty()) o.outputs = setup_.scene.run.outputs;
      if (o.outputs.empty()) o.outputs = m.coordinate_names();
      std::erase(o.outputs, "time");
      for (const auto& name : o.outputs) make_output(m, name);
    });
  }

  void finish(Json j, std::string text, const std::string& page, const std::string& table) {
    const Saving saving;
    if (interruption_ != 0) {
      j["status"] = "interrupted";
      j["error"] = note_;
    }
    if (!note_.empty()) text += "  " + note_ + "\n";
    const auto put = [&](const char* name, const char* what, const std::string& content) {
      if (setup_.write_file(name, [&](const auto& path) { write_file_atomically(path, content); }))
        text += fmt::format("  {}: {}\n", what, (setup_.directory / name).string());
    };
    put("tradeoff.html", "page", page);
    put("tradeoff.csv", "table", table);
    report(setup_, common_, j, text, "tradeoff.json");
  }

  const CommonOptions& common_;
  TradeoffOptions options_;
  Setup setup_;
  Progress progress_;
  int interruption_ = 0;
  std::string note_;
  std::vector<std::string> asked_outputs_;  // by name on the command line
};

}  // namespace

const RegisterCommand tradeoff_command(
    CommandGroup::judge, "tradeoff", "What accuracy costs on this scene: every combination, measured and recommended",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<TradeoffOptions>();
      TradeOptions& o = options->study;
      o.budget_s = 240;
      common.add_to(c);
      common.add_run_options(c);
      for (const char* name : {"--formulation", "--method", "--integrator", "--rtol", "--step"}) c.remove(name);
      c.option("--formulations", o.formulations, "These only, separated by commas").separated();
      c.option("--integrators", o.integrators, "These only, separated by commas (idas, cvodes, fixed)").separated();
      c.option("--levels", options->levels.scenes,
               "Scenes of less detail, separated by commas: each against SCENE, in the place of settings of one")
          .separated();
      c.option("--level-set", options->levels.changes,
               "SCENE with this change as a level (repeatable; several changes in one: joined by ';')")
          .value_name("PATH=VALUE")
          .repeatable();
      c.flag("--gradient", o.gradient, "Measure gradients as well, by every method");
      c.option("--methods", o.methods, "With --gradient: these methods only, separated by commas").separated();
      c.option("--rtols", options->tolerances, "Tolerances, separated by commas (default: 1e-3 to 1e-11)").separated();
      c.option("--steps", options->steps,
               "Lengths of fixed steps [s], separated by commas (default: the one for rtol 1e-3, halved seven times)")
          .separated();
      c.option("--outputs", o.outputs,
               "Outputs whose error along the motion counts, separated by commas (default: those of [run], else all "
               "coordinates)")
          .separated();
      c.option("--budget", o.budget_s, "Seconds that it may take in all; 0: no limit").shows_default();
      c.option("--patience", o.patience,
               "A run that takes more than this many times the processor time of the fastest at its setting is cut")
          .shows_default();
      c.option("--repeats", o.repeats, "Runs of each setting for the clock, in turns").shows_default();
      add_jobs_option(c, options->jobs, "Runs");
      c.option("--samples", o.samples, "Times at which the motions are compared").shows_default();
      c.runs([&common, options] { return Tradeoff(common, *options).run(); });
    });

}  // namespace costate::app
