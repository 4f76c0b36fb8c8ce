#include "optimize_options.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"

namespace costate::app {

namespace {

std::string algorithms_text() {
  std::string text;
  const auto& all = optimizer_algorithms();
  for (std::size_t i = 0; i < all.size(); ++i)
    text += (i == 0 ? "" : i + 1 == all.size() ? " or " : ", ") + all[i].name;
  return text;
}

}  // namespace

void OptimizeOptions::add_to(Command& c) {
  accuracy.add_to(c);
  c.flag("--resume", resume, "Continue an interrupted run from its journal");
  c.flag("--no-certificate", no_certificate,
         "Leave out the check of the optimum: multipliers and the Hessian's eigenvalues");
  c.flag("--no-report", no_report, "Leave out report.html, the page with plots");
  c.flag("--adapt-accuracy", adapt,
         "Evaluate at looser tolerances far from the optimum, at rtol in the end; --accuracy "
         "implies it");
  c.option("--stop-value", stop_value, "Stop once psi is this small");
  add_goal_option(c, goal);
  add_search(c);
}

void OptimizeOptions::add_search(Command& c) {
  c.option("--max-evaluations", max_evaluations, "Limit of evaluations");
  c.option("--step-limit-factor", step_limit_factor,
           "An evaluation fails beyond this many times the steps of those before (default 100; 0: no limit)");
  c.option("--algorithm", algorithm, algorithms_text()).suggests(setting_words("optimize.algorithm"));
  add_jobs_option(c, jobs, "Cases, or columns of differences, of gradients or a certificate's Hessian,");
}

OptimizerOptions optimizer_options(const DesignSetup& whole, const OptimizeOptions& options) {
  const Setup& setup = whole.setup;
  const Design design = whole.design();
  const bool constrained = !design.bounds().empty() || design.minimax();
  OptimizerOptions o(setup.scene.optimize);
  if (!options.algorithm.empty())
    o.algorithm = options.algorithm;
  else if (constrained && !o.algorithm_chosen)
    o.algorithm = kConstrainedAlgorithm;
  if (options.max_evaluations) o.max_evaluations = *options.max_evaluations;
  if (options.stop_value) o.stop_value = options.stop_value;
  o.step_limit_factor = options.step_limit_factor;
  if (!(o.step_limit_factor == 0 || (o.step_limit_factor >= 1 && std::isfinite(o.step_limit_factor))))
    throw Error(
        fmt::format("--step-limit-factor must be 1 or more, or 0 for no limit, found {}.", o.step_limit_factor));
  setup.chosen_by(!options.algorithm.empty(), "--algorithm", "optimize.algorithm", [&] {
    try {
      require_algorithm(o.algorithm, constrained);
    } catch (const CapabilityError& e) {
      if (design.bounds().empty() && design.minimax())
        throw CapabilityError(fmt::format("{} The worst of several cases is found by constraints.", e.what()));
      throw;
    }
  });
  setup.chosen_by(options.max_evaluations.has_value(), "--max-evaluations", "optimize.max_evaluations", [&] {
    if (o.max_evaluations < 1)
      throw Error(fmt::format("At least one evaluation is needed, found {}.", o.max_evaluations));
  });
  if (o.stop_value && std::isnan(*o.stop_value)) throw Error("--stop-value must be a number, found nan.");
  if (setup.problem.parameters.size() == 0)
    throw Error("There is no parameter to optimize: name some with --parameters or in [run].");
  const Objective& cost = setup.problem.objective;
  if (!whole.several() && cost.running.empty() && cost.terminal.empty())
    throw SceneError(setup.scene.locate("cost"),
                     "There is no cost to minimise: give the scene a term under "
                     "[[cost.running]] or [[cost.terminal]].");
  if (design.minimax() && o.gradient_tolerance > 0)
    throw SceneError(
        setup.scene.locate("optimize.gradient_tolerance"),
        "The gradient of the worst of several cases does not vanish at its minimum: leave "
        "'gradient_tolerance' out (or --set optimize.gradient_tolerance=0); 'relative_tolerance' ends it.");
  const std::string why_not = cannot_adapt(design);
  o.adapt_accuracy = o.adapt_accuracy || options.adapt;
  setup.chosen_by(options.adapt, "--adapt-accuracy", "optimize.adapt_accuracy", [&] {
    if (o.adapt_accuracy && !why_not.empty()) throw Error(why_not + " Leave it out.");
  });
  if (options.resume && !setup.files) throw Error("--resume reads the journal of the run, so it excludes --no-files.");
  whole.refuse_accuracy(options.accuracy.value.has_value());
  return o;
}

}  // namespace costate::app
