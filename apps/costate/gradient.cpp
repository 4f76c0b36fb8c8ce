// costate gradient: psi and its gradient by one method, with an estimate of its error on request.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "accuracy.h"
#include "costate/base/notice.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/tradeoff/trade_table.h"
#include "design_setup.h"
#include "digits.h"
#include "events_text.h"
#include "run_pages.h"
#include "start_notice.h"
#include "trajectory.h"

namespace costate::app {

namespace {

struct GradientOptions {
  AccuracyOption accuracy;
  bool estimate = false, single = false, report = false;
  std::string goal;
  int jobs = 0;
};

/// What nothing has confirmed knows nothing of psi, and of the gradient at most what a multiplier's differences leave,
/// which is no error to be told as all of it. Nor does what found something about fixed steps know their error.
bool knows_a_part(const Setup& setup, const GradientResult& r) {
  return (setup.problem.cycle || by_fixed_steps(setup.problem, find_sensitivity_method(setup.method))) &&
         r.gradient_error.empty() && r.known_error && r.known_error->psi == 0;
}

/// The parameters with their derivatives and, where there are any, errors.
std::string derivatives_text(const Setup& setup, const GradientResult& r, double relative) {
  const std::vector<double>& gradient = r.gradient;
  auto [errors, unknown] =
      gradient_digits(gradient, setup.problem.parameters, relative, r.gradient_error, r.known_error);
  if (knows_a_part(setup, r)) errors.clear();
  const auto names = setup.problem.parameters.names();
  std::size_t width = 9;
  for (const auto& n : names) width = std::max(width, n.size());
  std::string text = fmt::format("  {:<{}}  {:>20}  {:>20}{}\n", "parameter", width, "value", "d(psi)/d(parameter)",
                                 errors.empty() ? "" : "      estimated error");
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += fmt::format("  {:<{}}  {:>20.12g}  {:>20}", names[i], width, shown(setup.rho[i]),
                        known_digits(gradient[i], unknown[i]));
    if (!errors.empty()) text += fmt::format("  {:>19.2e}", errors[i]);
    text += "\n";
  }
  return text;
}

/// What the run knows of its error, into the summary's keys.
void add_known_error(const Setup& setup, const GradientResult& r, Json& j) {
  if (!r.known_error || knows_a_part(setup, r)) return;
  const Json& asked = j.at("psi_error");
  if (const auto of_psi =
          psi_error_of(asked.is_number() ? std::optional(asked.get<double>()) : std::nullopt, r.known_error))
    j["psi_error"] = *of_psi;
  const auto errors = gradient_error_of(r.gradient_error, r.known_error);
  if (errors.size() == r.gradient.size()) j["gradient_error"] = named(setup.problem.parameters.names(), errors);
}

/// Runs f; what it gives notice of is said of the case.
template <class F>
void of_case(const std::string& name, const F& f) {
  const std::vector<std::string> before = take_notices();
  f();
  const std::vector<std::string> own = take_notices();
  for (const std::string& sentence : before) notice(sentence);
  for (const std::string& sentence : own) notice(fmt::format("case.{}: {}", name, sentence));
}

/// gradient.html, where it is asked for; what the text says of it.
std::string report_text(const Setup& setup, const GradientOptions& options, Json& j, bool motion) {
  if (!options.report) return {};
  const std::optional<TrajectoryTable> table = motion ? motion_for_page(setup, j.at("settings")) : std::nullopt;
  add_notices(j);
  return written_page(setup, "gradient.html", gradient_page(setup, j, table ? &*table : nullptr));
}

/// Of a design of several cases.
int run_cases(DesignSetup& whole, const CommonOptions& common, const GradientOptions& options) {
  whole.refuse_accuracy(options.accuracy.value.has_value());
  Setup& setup = whole.setup;
  Progress progress(setup.progress_options);
  progress.start(setup.problem.solver.t_start);
  whole.watch(progress);
  const auto begin = std::chrono::steady_clock::now();
  for (Setup& s : whole.cases) s.problem.solver.confirm = !options.single && !options.estimate;
  const Design design = whole.design();
  const std::size_t count = design.cases.size(), n = setup.rho.size();
  std::vector<GradientResult> results(count);
  std::vector<std::optional<ErrorEstimate>> errors(count);
  for_each_job(count, jobs(), [&](std::size_t i) {
    const Setup& s = whole.cases[i];
    const std::vector<double> rho = design.cases[i].own(setup.rho);
    of_case(whole.of[i].name, [&] {
      try {
        results[i] = started(s, [&] { return gradient(s.problem, s.method, rho); });
        if (options.estimate)
          errors[i] = estimate_or_tell(
              [&] { return s.located([&] { return estimate_error(s.problem, s.method, rho, results[i]); }); });
      } catch (const SolverError& e) {
        throw SolverError(design.cases[i].title() + e.what());
      }
    });
  });
  const double wall = seconds_since(begin);
  tell_without_parameters(*setup.problem.mechanism, setup.problem.parameters);
  progress.finish();
  std::vector<double> psi;
  std::vector<std::vector<double>> gradients;
  GradientResult r;
  for (std::size_t i = 0; i < count; ++i) {
    psi.push_back(results[i].psi);
    gradients.push_back(design.cases[i].spread(results[i].gradient, n));
    r.counters += results[i].counters;
  }
  design.combine(psi, gradients, r.psi, r.gradient);
  // Errors add up at worst.
  const bool worst = design.goal == Design::Goal::worst;
  const std::size_t of_worst = design.worst(psi);
  std::optional<double> psi_error;
  const auto add_up = [&](const auto& of_case, double& psi_sum, std::vector<double>& sum) {
    sum.assign(n, 0.0);
    for (std::size_t g = 0; g < design.targets.size(); ++g)
      for (const std::size_t i : design.targets[g].cases) {
        if (worst && g != of_worst) continue;
        const auto [psi_of, gradient_of] = of_case(i);
        psi_sum += design.cases[i].factor * psi_of;
        const std::vector<double> own = design.cases[i].spread(gradient_of, n);
        for (std::size_t j = 0; j < n; ++j) sum[j] += design.cases[i].factor * own[j];
      }
  };
  if (options.estimate && std::all_of(errors.begin(), errors.end(), [](const auto& e) { return e.has_value(); })) {
    psi_error = 0;
    add_up([&](std::size_t i) { return *errors[i]; }, *psi_error, r.gradient_error);
  }
  if (std::any_of(results.begin(), results.end(), [](const auto& of) { return of.known_error.has_value(); })) {
    r.known_error.emplace();
    const auto known = [&](std::size_t i) {
      KnownError e = results[i].known_error.value_or(KnownError{});
      e.gradient.resize(results[i].gradient.size(), 0.0);
      r.known_error->all = r.known_error->all && e.all;
      return std::pair(e.psi, e.gradient);
    };
    add_up(known, r.known_error->psi, r.known_error->gradient);
  }
  const double relative = whole.psi_tolerance();
  for (std::size_t g = 0; worst && g < design.targets.size(); ++g)
    if (g != of_worst && r.psi - design.target(g, psi) <= 10 * relative * std::abs(r.psi))
      notice(
          fmt::format("'{}' and '{}' are equal within what the tolerances tell: the worst of them has a kink here, "
                      "and the gradient is that of the first alone.",
                      design.targets[of_worst].name, design.targets[g].name));
  Json j = run_json(setup, r, setup.method, wall);
  whole.correct(j);
  if (!options.estimate) j["gradient_error"] = nullptr;
  j["psi_error"] = psi_error ? Json(*psi_error) : Json();
  j["cases"] = whole.cases_json(psi, gradients);
  add_known_error(setup, r, j);
  if (worst) j["worst"] = design.targets[of_worst].name;
  std::string text =
      fmt::format("{}: {}\n", setup.scene.title.empty() ? common.scene : setup.scene.title, whole.what());
  text += whole.cases_text(psi);
  Precision held;
  held.relative = relative;
  text += fmt::format("  {}{}\n", psi_text(r.psi, held, psi_error, r.known_error),
                      worst ? fmt::format(", the worst: {}", design.targets[of_worst].name) : "");
  text += derivatives_text(setup, r, relative);
  text += fmt::format("  {} steps forward, {} backward, {} factorizations, {:.3g} s\n", r.counters.steps,
                      r.counters.backward_steps, r.counters.factorizations, wall);
  text += report_text(setup, options, j, false);
  report(setup, common, j, text, "gradient.json");
  return 0;
}

int run(const CommonOptions& common, const GradientOptions& options) {
  set_jobs(options.jobs);
  DesignSetup whole(common, options.goal);
  if (options.report && !whole.setup.files) throw Error("--report writes a page, so it excludes --no-files.");
  if (whole.several()) return run_cases(whole, common, options);
  Setup& setup = whole.setup;
  const bool estimate = options.estimate;
  Progress progress(setup.progress_options);
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  const auto begin = std::chrono::steady_clock::now();
  // An estimate compares the run itself with a tighter one.
  setup.problem.solver.confirm = !options.single && !estimate;
  const auto accuracy = options.accuracy.asked(setup, common);
  std::optional<AccurateRun> accurate;
  if (accuracy) accurate = run_accurately(setup, common, *accuracy, true);
  GradientResult r =
      accurate ? accurate->result : started(setup, [&] { return gradient(setup.problem, setup.method, setup.rho); });
  const double wall = seconds_since(begin);
  tell_without_parameters(*setup.problem.mechanism, setup.problem.parameters);
  // Differences estimate their own error, which the text shows in any case.
  std::optional<double> psi_error;
  if (accurate) {
    psi_error = accurate->psi_error;
    r.gradient_error = accurate->gradient_error;
  } else if (estimate) {
    // Differences tell their own error; a psi over a cycle is no plain run's, which is what the other estimate
    // compares.
    const bool by_method = !find_sensitivity_method(setup.method).perturbs || setup.problem.cycle;
    const std::optional<ErrorEstimate> e = estimate_or_tell([&] {
      return setup.located([&] {
        return by_method ? estimate_error(setup.problem, setup.method, setup.rho, r)
                         : estimate_error(setup.problem, setup.rho, r);
      });
    });
    if (e) psi_error = e->psi;
    if (e && by_method) {
      r.gradient_error.resize(e->gradient.size(), 0);
      for (std::size_t j = 0; j < e->gradient.size(); ++j)
        r.gradient_error[j] = std::max(r.gradient_error[j], e->gradient[j]);
    }
  }
  progress.finish();
  Json j = run_json(setup, r, setup.method, wall);
  if (accurate) j["accuracy"] = accuracy_json(*accurate, *accuracy);
  j["psi_error"] = psi_error ? Json(*psi_error) : Json();
  add_known_error(setup, r, j);
  const Precision precision = precision_of(setup.problem.solver, r.integrator, r.counters.steps);
  const Combination what{setup.problem.formulation, r.integrator, setup.method};
  std::string text = fmt::format("{}\n  {}, {}\n  {}\n", setup.scene.title.empty() ? common.scene : setup.scene.title,
                                 what.name(), precision.run, psi_text(r.psi, precision, psi_error, r.known_error));
  text += derivatives_text(setup, r, precision.relative);
  if (accurate) text += accuracy_text(*accurate, *accuracy);
  text += events_text(r, times_uncertainty(setup.problem.solver, precision, accurate ? &*accurate : nullptr));
  text += fmt::format("  {} steps forward, {} backward, {} factorizations, {:.3g} s\n", r.counters.steps,
                      r.counters.backward_steps, r.counters.factorizations, wall);
  text += report_text(setup, options, j, true);
  report(setup, common, j, text, "gradient.json");
  return accurate && !accurate->met ? kFailed : 0;
}

}  // namespace

const RegisterCommand gradient_command(
    CommandGroup::run, "gradient", "The cost and its exact gradient by one method",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<GradientOptions>();
      common.add_to(c);
      common.add_run_options(c);
      options->accuracy.add_to(c);
      c.flag("--estimate-error", options->estimate,
             "Estimate the errors of psi and gradient by a rerun at rtol/10 or less, or half the step");
      c.flag("--no-confirm", options->single, "One run, without the looser one that shows where small errors grow");
      c.flag("--report", options->report, "Write gradient.html too, a page with the derivatives and the motion");
      add_goal_option(c, options->goal);
      add_jobs_option(c, options->jobs, "Cases, or columns of differences,");
      c.runs([&common, options] { return run(common, *options); });
    });

}  // namespace costate::app
