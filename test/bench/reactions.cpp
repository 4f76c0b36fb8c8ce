// What stored reactions cost: a run that stores accelerations and multipliers at samples against the same one that
// stores nothing. Its steps and callbacks are the same; samples evaluate the equations, and factor where a formulation
// solves for its accelerations.
#include <fmt/format.h>

#include <cmath>

#include "benchmark.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/tradeoff/stopwatch.h"
#include "support/paths.h"

namespace costate::bench {

namespace {

constexpr int kSamples = 1000;

struct Stored {
  std::vector<double> numbers;  // accelerations and multipliers, sample by sample
  long dynamics = 0;            // evaluations of the equations until the last sample
  Simulation run;
};

/// With `count` samples, evenly spaced, the last at the end.
Stored stored(const Problem& problem, int count) {
  Stored s;
  std::vector<double> times;
  const double begin = problem.solver.t_start, span = problem.solver.t_end - begin;
  for (int k = 1; k <= count; ++k) times.push_back(k == count ? begin + span : begin + span * k / count);
  s.run = simulate(problem, problem.parameters.values(), times, [&](const MechanismState& state, System& system) {
    const Assembly& a = system.assembly();
    s.numbers.insert(s.numbers.end(), state.a, state.a + a.n());
    s.numbers.insert(s.numbers.end(), state.lambda, state.lambda + a.m());
    s.dynamics = a.counters().dynamics;
  });
  return s;
}

void compare(Report& report, const std::string& scene, const char* formulation, const char* integrator,
             const Settings& settings) {
  Problem problem = make_problem(Scene::load(std::string(COSTATE_MODELS_DIR "/") + scene + ".toml"));
  problem.formulation = formulation;
  problem.solver.integrator = integrator;
  if (settings.quick) problem.solver.t_end = problem.solver.t_start + 0.1;
  const std::vector<double> rho = problem.parameters.values();
  const Stored one = stored(problem, 1), all = stored(problem, kSamples);
  Race race;
  const int without = race.add([&] { simulate(problem, rho); });
  const int with = race.add([&] { stored(problem, kSamples); });
  race.run(settings.rounds);
  take_notices();
  const double time = race.median_ratio(with, without),
               evaluations = static_cast<double>(all.dynamics) / static_cast<double>(one.dynamics);
  // Maggi's positions are found from the last ones, so that a sample moves what follows: psi by less than its
  // tolerance.
  const bool same = callbacks(all.run.counters) == callbacks(one.run.counters) &&
                    std::abs(all.run.psi - one.run.psi) <= problem.solver.rtol * std::abs(one.run.psi);
  report.text +=
      fmt::format("  {:<24}{:<12}{:<10}{:>8}{:>10}{:>12}{:>12}{:>9.2f}{:>9.2f}{}\n", scene.substr(scene.find('/') + 1),
                  formulation, integrator, all.run.counters.steps, callbacks(all.run.counters), one.dynamics,
                  all.dynamics, evaluations, time, same ? "" : "  another run !");
  report.json["rows"].push_back({{"scene", scene},
                                 {"formulation", formulation},
                                 {"integrator", integrator},
                                 {"samples", kSamples},
                                 {"counters", counters_json(all.run.counters)},
                                 {"evaluations_without", one.dynamics},
                                 {"evaluations_with", all.dynamics},
                                 {"same_run", same},
                                 {"psi_change", all.run.psi - one.run.psi},
                                 {"ratio", time}});
}

}  // namespace

Report reactions(const Settings& settings) {
  Report report;
  report.json["rows"] = nlohmann::json::array();
  report.text = fmt::format(
      "Reactions and accelerations stored at {} samples against nothing stored: steps, callbacks (of both), "
      "evaluations "
      "of the equations without and with, their ratio, and that of the medians of {} interleaved rounds.\n"
      "  {:<24}{:<12}{:<10}{:>8}{:>10}{:>12}{:>12}{:>9}{:>9}\n",
      kSamples, settings.rounds, "", "", "", "steps", "callbacks", "without", "with", "ratio", "time");
  for (const auto& [formulation, integrator] :
       {std::pair("baumgarte", "idas"), std::pair("index1", "cvodes"), std::pair("index2", "idas"),
        std::pair("maggi", "cvodes"), std::pair("penalty", "idas")}) {
    compare(report, "five_bar/five_bar", formulation, integrator, settings);
    compare(report, "iltis/four_post_white", formulation, integrator, settings);
  }
  return report;
}

}  // namespace costate::bench
