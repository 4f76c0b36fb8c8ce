#include "compare_side.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/motion_confirmation.h"

namespace costate::app {

CompareSide make_compare_side(const CommonOptions& common, const std::string& scene,
                              const std::vector<std::string>& set, bool differentiate) {
  CommonOptions options = common;
  options.scene = scene;
  options.overrides.insert(options.overrides.end(), set.begin(), set.end());
  try {
    return {Setup(options, differentiate ? Purpose::differentiate : Purpose::simulate)};
  } catch (const SceneError&) {
    throw;
  } catch (const Error& e) {  // an option's: say of which scene
    throw Error(fmt::format("{} (in scene '{}')", e.what(), scene));
  }
}

void CompareSide::run(double end, long samples, const std::vector<std::string>& outputs, bool differentiates) {
  const SolverOptions& solver = setup.problem.solver;
  const auto begin = std::chrono::steady_clock::now();
  result = GradientResult(setup.located([&] { return simulate(setup.problem, setup.rho); }));
  simulation_s = seconds_since(begin);
  const Problem whole = setup.problem;
  setup.problem.ends_when.reset();
  setup.problem.solver.t_end = end;
  TrajectoryRecorder recorder(setup, setup.rho, (end - solver.t_start) / static_cast<double>(samples));
  const GradientResult confirmed = setup.located([&] {
    return confirmed_simulation(setup.problem, setup.rho, {recorder.times(), recorder.sink()}, outputs);
  });
  motion = recorder.finish(Json());
  setup.problem = whole;
  if (!whole.ends_when) result.known_error = confirmed.known_error;
  if (!differentiates) return;
  const auto gradient_begin = std::chrono::steady_clock::now();
  GradientResult g = setup.located([&] { return gradient(setup.problem, setup.method, setup.rho); });
  gradient_s = seconds_since(gradient_begin);
  result.psi = g.psi;
  result.gradient = std::move(g.gradient);
  result.gradient_error = std::move(g.gradient_error);
  result.known_error = std::move(g.known_error);
}

}  // namespace costate::app
