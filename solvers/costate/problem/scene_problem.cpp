#include "costate/problem/scene_problem.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace costate {

void require_single_run(const Scene& scene) {
  if (scene.cases.empty()) return;
  std::vector<std::string> names;
  for (const SceneCase& c : scene.cases) names.push_back(c.name);
  throw SceneError(
      scene.cases.front().where,
      fmt::format("The scene lists cases, [[case]], that 'gradient', 'optimize' and 'pareto' take together. "
                  "A run is that of one: --case NAME, one of {}.",
                  fmt::join(names, ", ")));
}

Problem make_problem(const Scene& scene, const std::vector<std::string>& parameters) {
  require_single_run(scene);
  const RunSettings& run = scene.run;
  Problem p;
  p.mechanism = scene.mechanism();
  p.parameters = p.mechanism->select(parameters.empty() ? run.parameters : parameters);
  p.objective = scene.objective();
  p.formulation = run.formulation;
  p.formulation_options = scene.formulation;
  SolverOptions& s = p.solver;
  s.t_start = run.t_start_s;
  s.t_end = run.t_end_s;
  s.rtol = run.rtol;
  s.atol = run.atol.value_or(0);
  s.integrator = run.integrator;
  if (!run.cvodes_method.empty()) s.cvodes_method = run.cvodes_method;
  if (!run.sensitivity_corrector.empty()) s.staggered = run.sensitivity_corrector == "staggered";
  s.step_s = run.step_s.value_or(0);
  s.max_step_s = run.max_step_s.value_or(0);
  if (run.ends_when) {
    EndEvent end;
    end.output = make_output(*p.mechanism, run.ends_when->output);
    end.above = run.ends_when->above;
    end.level_number = run.ends_when->level_number;
    p.ends_when = std::make_shared<EndEvent>(std::move(end));
  }
  if (run.cycle) p.cycle = std::make_shared<const CycleSettings>(*scene.cycle);
  return p;
}

}  // namespace costate
