// Runs of scenes for tests: outputs at given times. The runs have rtol 1e-11 and up to 1e3 steps, whose
// errors add up to kMotion = 1e-8 of the size of the motion where it does not amplify them.
#pragma once

#include <catch2/catch.hpp>
#include <memory>
#include <string>
#include <vector>

#include "costate/integrator/simulate.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

namespace costate::test {

inline constexpr double kRtol = 1e-11, kMotion = 1e-8;

inline Problem problem_of(const Scene& scene, double t_end, const std::string& formulation = "baumgarte",
                          const std::vector<std::string>& parameters = {}) {
  Problem p;
  p.mechanism = scene.mechanism();
  p.objective = scene.objective();
  p.parameters = p.mechanism->select(parameters);
  p.formulation = formulation;
  p.formulation_options = scene.formulation;
  p.solver.rtol = kRtol;
  p.solver.t_end = t_end;
  return p;
}

using Values = std::vector<double>;

/// The outputs at each time.
inline std::vector<Values> run(const Scene& scene, const std::vector<double>& times,
                               const std::vector<std::string>& names, const std::string& formulation = "baumgarte") {
  std::vector<std::unique_ptr<Output>> outputs;
  for (const auto& name : names) outputs.push_back(make_output(*scene.mechanism(), name));
  std::vector<Values> result;
  const Problem p = problem_of(scene, times.back(), formulation);
  simulate(p, p.parameters.values(), times, [&](const MechanismState& s, System& system) {
    Values row;
    for (const auto& o : outputs) row.push_back(o->value(s, system.assembly()));
    result.push_back(row);
  });
  return result;
}

inline std::vector<double> times_to(double end, int count) {
  std::vector<double> t;
  for (int i = 1; i <= count; ++i) t.push_back(end * i / count);
  return t;
}

}  // namespace costate::test
