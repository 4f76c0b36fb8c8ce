// A chain of bars: adjoint and forward gradients against the number of parameters, and the time of a step against the
// length of the chain (sparse all the way: the exponent stays near 1).
#include <fmt/format.h>

#include <memory>

#include "benchmark.h"
#include "chain.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"
#include "fit_exponent.h"

namespace costate::bench {

namespace {

struct Job {
  Problem problem;
  std::string method;  // empty: a simulation
  int job = -1, simulation = -1;
  GradientResult result;
};

struct Case {
  const char *formulation, *integrator;
};
constexpr Case kCases[] = {{"index1", "idas"}, {"index2", "idas"}, {"baumgarte", "cvodes"}};

int add(Race& race, std::vector<std::unique_ptr<Job>>& jobs, const Case& c, Problem problem, const std::string& method,
        int simulation) {
  Job& j = *jobs.emplace_back(std::make_unique<Job>());
  j.problem = std::move(problem);
  j.problem.formulation = c.formulation;
  j.problem.solver.integrator = c.integrator;
  j.problem.solver.confirm = false;
  j.method = method;
  j.simulation = simulation;
  const std::vector<double> rho = j.problem.parameters.values();
  j.job = race.add([&j, rho] {
    j.result = j.method.empty() ? GradientResult(simulate(j.problem, rho)) : gradient(j.problem, j.method, rho);
  });
  return j.job;
}

void against_parameters(const Settings& settings, Report& report) {
  const int bars = settings.quick ? 10 : 100;
  std::vector<int> counts = {2, 20, 200};
  if (settings.quick) counts = {2, 20};
  Race race;
  std::vector<std::unique_ptr<Job>> jobs;
  for (const Case& c : kCases) {
    const int simulation = add(race, jobs, c, make_chain(bars, 0), "", -1);
    for (const char* direction : {"-adjoint", "-forward"})
      for (const int count : counts)
        add(race, jobs, c, make_chain(bars, count), c.integrator + std::string(direction), simulation);
  }
  race.run(std::min(settings.rounds, 3));

  report.text += fmt::format(
      "Gradients of a chain of {} bars, 1 s, rtol 1e-6, against the number of parameters; /sim: times a simulation;\n"
      "/2: callbacks and time as multiples of those with 2 parameters\n"
      "  {:<11}{:<18}{:>11}{:>10}{:>8}{:>8}{:>8}{:>11}{:>8}{:>8}\n",
      bars, "", "", "parameters", "ms", "/sim", "steps", "back", "callbacks", "/2", "time/2");
  nlohmann::json rows = nlohmann::json::array();
  const Job* first = nullptr;  // with the fewest parameters, of the same method
  for (const auto& j : jobs) {
    const int count = j->problem.parameters.size();
    const Counters& c = j->result.counters;
    if (!j->method.empty() && count == counts.front()) first = j.get();
    nlohmann::json row = {{"formulation", j->problem.formulation},
                          {"method", j->method.empty() ? "simulation" : j->method},
                          {"parameters", count},
                          {"ms", race.minimum_ms(j->job)},
                          {"counters", counters_json(c)}};
    std::string simulations, growth, slower;
    if (!j->method.empty()) {
      const double s = race.ratio(j->job, j->simulation), t = race.ratio(j->job, first->job);
      const double g = static_cast<double>(callbacks(c)) / static_cast<double>(callbacks(first->result.counters));
      simulations = fmt::format("{:.2f}", s);
      growth = fmt::format("{:.2f}", g);
      slower = fmt::format("{:.2f}", t);
      row["over_simulation"] = s;
      row["callbacks_over_fewest_parameters"] = g;
      row["time_over_fewest_parameters"] = t;
    }
    report.text += fmt::format("  {:<11}{:<18}{:>11}{:>10.2f}{:>8}{:>8}{:>8}{:>11}{:>8}{:>8}\n", j->problem.formulation,
                               j->method.empty() ? "simulation" : j->method, count, race.minimum_ms(j->job),
                               simulations, c.steps, c.backward_steps, callbacks(c), growth, slower);
    rows.push_back(std::move(row));
  }
  report.json["against_parameters"] = {{"bars", bars}, {"rows", std::move(rows)}};
}

void against_length(const Settings& settings, Report& report) {
  std::vector<int> lengths = {10, 25, 50, 100, 200, 400};
  if (settings.quick) lengths = {5, 10};
  Race race;
  std::vector<std::unique_ptr<Job>> jobs;
  for (const Case& c : kCases)
    for (const int bars : lengths) {
      Problem problem = make_chain(bars, 2);
      problem.solver.t_end = 0.1;  // only the time of a step counts
      const int simulation = add(race, jobs, c, problem, "", -1);
      add(race, jobs, c, problem, c.integrator + std::string("-adjoint"), simulation);
    }
  race.run(std::min(settings.rounds, 5));

  report.text +=
      "\nTime of a step [us] against the number of bars, simulation and adjoint gradient (its forward and "
      "backward steps),\nand the exponent of its growth over all lengths\n";
  report.text += fmt::format("  {:<11}{:<18}", "", "");
  for (const int bars : lengths) report.text += fmt::format("{:>9}", bars);
  report.text += fmt::format("{:>11}\n", "exponent");
  nlohmann::json rows = nlohmann::json::array();
  const std::vector<double> x(lengths.begin(), lengths.end());
  for (std::size_t c = 0; c < std::size(kCases); ++c)
    for (const std::size_t kind : {0, 1}) {
      std::vector<double> us;
      for (std::size_t k = 0; k < lengths.size(); ++k) {
        const Job& j = *jobs[2 * (c * lengths.size() + k) + kind];
        const auto steps = static_cast<double>(j.result.counters.steps + j.result.counters.backward_steps);
        us.push_back(1e3 * race.minimum_ms(j.job) / steps);
      }
      const std::string method = kind == 0 ? "simulation" : std::string(kCases[c].integrator) + "-adjoint";
      report.text += fmt::format("  {:<11}{:<18}", kCases[c].formulation, method);
      for (const double t : us) report.text += fmt::format("{:>9.1f}", t);
      report.text += fmt::format("{:>11.2f}\n", fit_exponent(x, us));
      rows.push_back({{"formulation", kCases[c].formulation},
                      {"method", method},
                      {"bars", lengths},
                      {"us_per_step", us},
                      {"exponent", fit_exponent(x, us)}});
    }
  report.json["against_length"] = std::move(rows);
}

}  // namespace

Report parameters(const Settings& settings) {
  Report report;
  against_parameters(settings, report);
  against_length(settings, report);
  return report;
}

}  // namespace costate::bench
