#include "figures.h"

#include <fmt/format.h>

#include <tuple>

#include "costate/base/error.h"
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

FiguresOfRun figures_of_table(const Scene& scene, const TrajectoryTable& table, std::size_t count) {
  FiguresOfRun r;
  const SceneNumbers numbers = scene_numbers(scene);
  const auto mechanism = scene.mechanism();
  std::vector<std::string> coordinates = mechanism->coordinate_names();
  const auto columns = [&](const char* group, const std::vector<std::string>& names) {
    std::vector<const Column*> found;
    for (const std::string& name : names) {
      found.push_back(table.find(group, name));
      if (!found.back()) throw Error(fmt::format("A trajectory without '{}' ({}) cannot be drawn.", name, group));
    }
    return found;
  };
  const auto q = columns("coordinates", coordinates), v = columns("velocities", coordinates),
             z = columns("states", mechanism->state_names());
  const auto row = [](const std::vector<const Column*>& of, std::size_t i) {
    Eigen::VectorXd x(static_cast<Eigen::Index>(of.size()));
    for (std::size_t k = 0; k < of.size(); ++k) x[static_cast<Eigen::Index>(k)] = of[k]->values[i];
    return x;
  };
  const std::size_t samples = table.time_s.size(), wanted = std::min(samples, count);
  for (std::size_t k = 0; k < wanted; ++k) {
    const std::size_t i = wanted < 2 ? 0 : k * (samples - 1) / (wanted - 1);
    r.times.push_back(table.time_s[i]);
    r.figures.push_back(make_figure(*mechanism, numbers, row(q, i), row(v, i), row(z, i), table.time_s[i]));
  }
  return r;
}

}  // namespace costate::app
