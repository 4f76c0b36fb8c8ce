// costate gradient: psi and its gradient by one method, with an estimate of its error on request.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "accuracy.h"
#include "command.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/error_estimate.h"
#include "digits.h"
#include "start_notice.h"
#include "trajectory.h"

namespace costate::app {

namespace {

int run(const CommonOptions& common, const AccuracyOption& option, bool estimate, bool confirm, int jobs) {
  set_jobs(jobs);
  Setup setup(common, Purpose::differentiate);
  Progress progress(setup.progress_options);
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  const auto begin = std::chrono::steady_clock::now();
  // An estimate compares the run itself with a tighter one.
  setup.problem.solver.confirm = confirm && !estimate;
  const auto accuracy = option.asked(setup, common);
  std::optional<AccurateRun> accurate;
  if (accuracy) accurate = run_accurately(setup, common, *accuracy, true);
  GradientResult r =
      accurate ? accurate->result : started(setup, [&] { return gradient(setup.problem, setup.method, setup.rho); });
  const double wall = seconds_since(begin);
  // Differences estimate their own error, which the text shows in any case.
  std::optional<double> psi_error;
  if (accurate) {
    psi_error = accurate->psi_error;
    r.gradient_error = accurate->gradient_error;
  } else if (estimate) {
    // A psi over a cycle is no plain run's, which is what the other estimate compares.
    const bool by_method = r.gradient_error.empty() || setup.problem.cycle;
    const ErrorEstimate e = setup.located([&] {
      return by_method ? estimate_error(setup.problem, setup.method, setup.rho, r)
                       : estimate_error(setup.problem, setup.rho, r);
    });
    psi_error = e.psi;
    if (by_method) {
      r.gradient_error.resize(e.gradient.size(), 0);
      for (std::size_t j = 0; j < e.gradient.size(); ++j)
        r.gradient_error[j] = std::max(r.gradient_error[j], e.gradient[j]);
    }
  }
  progress.finish();
  Json j = run_json(setup, r, setup.method, wall);
  if (!estimate && !accurate) j["gradient_error"] = nullptr;
  if (accurate) j["accuracy"] = accuracy_json(*accurate, *accuracy);
  j["psi_error"] = psi_error ? Json(*psi_error) : Json();
  const Precision precision = precision_of(setup.problem.solver, r.integrator, r.counters.steps);
  std::string text =
      fmt::format("{}\n  {} by {}, {}\n  {}\n", setup.scene.title.empty() ? common.scene : setup.scene.title,
                  setup.problem.formulation, setup.method, precision.run, psi_text(r.psi, precision, psi_error));
  const std::vector<double> unknown =
      r.gradient_error.empty() ? gradient_uncertainty(r.gradient, setup.problem.parameters, precision.relative)
                               : r.gradient_error;
  const auto names = setup.problem.parameters.names();
  std::size_t width = 9;
  for (const auto& n : names) width = std::max(width, n.size());
  text += fmt::format("  {:<{}}  {:>20}  {:>20}{}\n", "parameter", width, "value", "d(psi)/d(parameter)",
                      r.gradient_error.empty() ? "" : "      estimated error");
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += fmt::format("  {:<{}}  {:>20.12g}  {:>20}", names[i], width, setup.rho[i],
                        known_digits(r.gradient[i], unknown[i]));
    if (!r.gradient_error.empty()) text += fmt::format("  {:>19.2e}", r.gradient_error[i]);
    text += "\n";
  }
  if (accurate) text += accuracy_text(*accurate, *accuracy);
  text += events_text(r);
  text += fmt::format("  {} steps forward, {} backward, {} factorizations, {:.3g} s\n", r.counters.steps,
                      r.counters.backward_steps, r.counters.factorizations, wall);
  report(setup, common, j, text, "gradient.json");
  return accurate && !accurate->met ? kFailed : 0;
}

}  // namespace

const RegisterCommand gradient_command(
    CommandGroup::run, "gradient", "The cost and its exact gradient by one method",
    [](Command& c, CommonOptions& common) {
      auto estimate = std::make_shared<bool>(false), single = std::make_shared<bool>(false);
      auto accuracy = std::make_shared<AccuracyOption>();
      common.add_to(c);
      common.add_run_options(c);
      accuracy->add_to(c);
      c.flag("--estimate-error", *estimate,
             "Estimate the errors of psi and gradient by a rerun at rtol/10, or half the step");
      c.flag("--no-confirm", *single, "One run, without the looser one that shows where small errors grow");
      auto jobs = std::make_shared<int>(0);
      add_jobs_option(c, *jobs, "Columns of differences");
      c.runs(
          [&common, accuracy, estimate, single, jobs] { return run(common, *accuracy, *estimate, !*single, *jobs); });
    });

}  // namespace costate::app
