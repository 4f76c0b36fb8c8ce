#include "figures.h"

#include <fmt/format.h>

#include <tuple>

#include "costate/integrator/run_end.h"
#include "costate/integrator/simulate.h"
#include "costate/scene/scene_node.h"
#include "costate/scene/toml_reader.h"
#include "costate/sensitivity/cycle_gradient.h"
#include "costate/trajectory.h"

namespace costate::app {

SceneNumbers scene_numbers(const Scene& scene) {
  const auto root = std::make_shared<const SceneNode>(read_toml(scene.dump(), scene.file_name()));
  return [root](const std::string& path) -> std::optional<double> {
    const SceneNode* n = find_node(*root, path);
    return n && n->is_number() ? std::optional(n->as_double()) : std::nullopt;
  };
}

FiguresOfRun figures_of_run(const Setup& given, std::optional<double> step, std::vector<double> times) {
  FiguresOfRun r;
  Setup setup = given;
  std::tie(setup.problem, setup.rho) = shown_motion(given.problem, given.rho);
  if (times.empty()) {
    const auto& solver = setup.problem.solver;
    if (!step && !setup.scene.run.output_step_s)
      step = (until_its_end(setup.problem, setup.rho).solver.t_end - solver.t_start) / 300;
    times = TrajectoryRecorder(setup, setup.rho, step).times();
  }
  const SceneNumbers numbers = scene_numbers(setup.scene);
  const Mechanism& m = *setup.problem.mechanism;
  const auto sample = [&](const MechanismState& s, System& system) {
    const Assembly& a = system.assembly();
    using Eigen::Map, Eigen::VectorXd;
    r.times.push_back(s.t);
    r.figures.push_back(make_figure(m, numbers, Map<const VectorXd>(s.q, a.n()), Map<const VectorXd>(s.v, a.n()),
                                    Map<const VectorXd>(s.z, a.nz()), s.t));
  };
  simulate(setup.problem, setup.rho, times, sample);
  return r;
}

}  // namespace costate::app
