// The discrete adjoint against the fixed-step simulation that it belongs to, with all of a scene's parameters. Target:
// the pass back at most 1 simulation, the gradient with its forward run at most 2.
#include <fmt/format.h>

#include "benchmark.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"
#include "model.h"

namespace costate::bench {

Report discrete(const Settings& settings) {
  Report report;
  report.json["target"] = 2.0;
  report.json["rows"] = nlohmann::json::array();
  report.text = fmt::format(
      "Discrete adjoint, gradient / simulation (target <= 2: the pass back costs at most one simulation); minimum of "
      "{} "
      "interleaved rounds.\n  {:<16}{:<18}{:>11}{:>8}{:>10}{:>10}{:>8}{:>8}\n",
      settings.rounds, "", "scheme", "parameters", "steps", "sim ms", "grad ms", "ratio", "factor");
  for (const char* scene : {"five_bar/five_bar.toml", "andrews/andrews.toml", "n_four_bar/n_four_bar_40.toml"}) {
    const Model model = load_model(scene);
    for (const char* scheme : {"newmark", "generalized-alpha"}) {
      Problem p = model.problem;
      p.formulation = "index3";
      p.formulation_options.set("discrete_scheme", scheme);
      p.solver.integrator = "fixed";
      p.solver.step_s = p.solver.t_end / (settings.quick ? 50 : 1000);
      const std::vector<double> rho = p.parameters.values();
      Race race;
      GradientResult result;
      const int simulation = race.add([&] { simulate(p, rho); });
      const int adjoint = race.add([&] { result = gradient(p, "discrete-adjoint", rho); });
      race.run(settings.rounds);
      const double ratio = race.ratio(adjoint, simulation);
      report.text +=
          fmt::format("  {:<16}{:<18}{:>11}{:>8}{:>10.2f}{:>10.2f}{:>7.2f}{}{:>8}\n", model.name, scheme, rho.size(),
                      result.counters.steps, race.minimum_ms(simulation), race.minimum_ms(adjoint), ratio,
                      ratio <= 2 ? ' ' : '!', result.counters.factorizations);
      report.json["rows"].push_back({{"scene", model.name},
                                     {"scheme", scheme},
                                     {"parameters", rho.size()},
                                     {"steps", result.counters.steps},
                                     {"simulation_ms", race.minimum_ms(simulation)},
                                     {"gradient_ms", race.minimum_ms(adjoint)},
                                     {"ratio", ratio},
                                     {"counters", counters_json(result.counters)}});
    }
  }
  return report;
}

}  // namespace costate::bench
