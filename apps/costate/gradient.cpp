// costate gradient: psi and its gradient by one method, with an estimate of its error on request.
#include <fmt/format.h>

#include <chrono>

#include "command.h"
#include "trajectory.h"

namespace costate::app {

namespace {

int run(const CommonOptions& common, bool estimate) {
  Setup setup(common, Purpose::differentiate);
  Progress progress(setup.progress_options);
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  const auto begin = std::chrono::steady_clock::now();
  GradientResult r = setup.located([&] { return gradient(setup.problem, setup.method, setup.rho); });
  const double wall = seconds_since(begin);
  // Differences estimate their own error, which the text shows in any case.
  if (estimate && r.gradient_error.empty())
    r.gradient_error =
        setup.located([&] { return estimate_gradient_error(setup.problem, setup.method, setup.rho, r); });
  progress.finish();
  Json j = run_json(setup, r, setup.method, wall);
  if (!estimate) j["gradient_error"] = nullptr;
  std::string text = fmt::format("{}\n  {} by {}, rtol {:g}\n  psi = {:.12g}\n",
                                 setup.scene.title.empty() ? common.scene : setup.scene.title,
                                 setup.problem.formulation, setup.method, setup.problem.solver.rtol, r.psi);
  const auto names = setup.problem.parameters.names();
  std::size_t width = 9;
  for (const auto& n : names) width = std::max(width, n.size());
  text += fmt::format("  {:<{}}  {:>20}  {:>20}{}\n", "parameter", width, "value", "d(psi)/d(parameter)",
                      r.gradient_error.empty() ? "" : "      estimated error");
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += fmt::format("  {:<{}}  {:>20.12g}  {:>20.12g}", names[i], width, setup.rho[i], r.gradient[i]);
    if (!r.gradient_error.empty()) text += fmt::format("  {:>19.2e}", r.gradient_error[i]);
    text += "\n";
  }
  text += fmt::format("  {} steps forward, {} backward, {} factorizations, {:.3g} s\n", r.counters.steps,
                      r.counters.backward_steps, r.counters.factorizations, wall);
  report(setup, common, j, text, "gradient.json");
  return 0;
}

}  // namespace

void add_gradient(CLI::App& app, std::function<int()>& action, CommonOptions& common) {
  CLI::App* c = app.add_subcommand("gradient", "The cost and its exact gradient by one method");
  auto estimate = std::make_shared<bool>(false);
  common.add_to(*c);
  common.add_run_options(*c);
  c->add_flag("--estimate-error", *estimate, "Estimate the gradient's error by a rerun at rtol/10");
  c->callback([&action, &common, estimate] { action = [&common, estimate] { return run(common, *estimate); }; });
}

}  // namespace costate::app
