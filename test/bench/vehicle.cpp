// The full vehicle through the double lane change: how much faster than real time, adjoint gradients of 6 and of 100
// parameters against a simulation, and the time of a step with 1, 10 and 100 vehicles in one scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "benchmark.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"
#include "fleet.h"
#include "support/paths.h"

namespace costate::bench {

namespace {

constexpr double kRealTime = 20, kPsiError = 1e-3, kSimulations = 3, kManyOverFew = 1.3;  // targets
constexpr std::size_t kMany = 100;                                                        // parameters

struct Case {
  const char *formulation, *integrator, *multistep;
};
constexpr Case kCases[] = {{"index1", "idas", ""},
                           {"baumgarte", "cvodes", "bdf"},
                           {"baumgarte", "cvodes", "adams"},
                           {"penalty", "cvodes", "bdf"}};

Scene double_lane_change() { return Scene::load(COSTATE_MODELS_DIR "/iltis/double_lane_change.toml"); }

Problem with(Problem p, const Case& c, double rtol) {
  p.formulation = c.formulation;
  p.solver.integrator = c.integrator;
  if (*c.multistep) p.solver.cvodes_method = c.multistep;
  p.solver.rtol = rtol;
  p.solver.confirm = false;
  return p;
}

struct Job {
  Problem problem;
  std::string method;  // empty: a simulation
  int job = -1;
  GradientResult result;
};

using Jobs = std::vector<std::unique_ptr<Job>>;

Job& add(Race& race, Jobs& jobs, Problem problem, const std::string& method) {
  Job& j = *jobs.emplace_back(std::make_unique<Job>());
  j.problem = std::move(problem);
  j.method = method;
  const std::vector<double> rho = j.problem.parameters.values();
  j.job = race.add([&j, rho] {
    j.result = j.method.empty() ? GradientResult(simulate(j.problem, rho)) : gradient(j.problem, j.method, rho);
  });
  return j;
}

/// Simulated seconds per second of processor at the loosest tolerance that is good enough.
void against_real_time(const Settings& settings, Report& report) {
  Problem base = make_problem(double_lane_change());
  if (settings.quick) base.solver.t_end = 1;
  const double span = base.solver.t_end - base.solver.t_start;
  report.text += fmt::format(
      "The double lane change, {} s, one core: seconds simulated in a second, and the error of psi against rtol 1e-10 "
      "of the\nsame formulation, in parentheses that of the formulation against index1. Target: {:g} at an error of "
      "{:g}.\n  {:<11}{:<8}{:<7}{:>8}{:>10}{:>10}{:>8}{:>11}{:>10}{:>11}\n",
      span, kRealTime, kPsiError, "", "", "", "rtol", "ms", "s/s", "steps", "callbacks", "psi err", "(form.)");
  nlohmann::json rows = nlohmann::json::array();
  double index1 = 0;
  for (const Case& c : kCases) {
    const Problem tight = with(base, c, settings.quick ? 1e-8 : 1e-10);
    const double psi = simulate(tight, tight.parameters.values()).psi;
    if (index1 == 0) index1 = psi;
    Race race;
    Jobs jobs;
    for (const double rtol : {1e-4, 1e-5, 1e-6, 1e-7}) {
      const Problem p = with(base, c, rtol);
      if (!(std::abs(simulate(p, p.parameters.values()).psi / psi - 1) < kPsiError)) continue;
      add(race, jobs, p, "");
      break;
    }
    if (jobs.empty()) {
      report.text += fmt::format("  {:<11}{:<8}{:<7} not within {:g} at rtol 1e-7\n", c.formulation, c.integrator,
                                 c.multistep, kPsiError);
      continue;
    }
    race.run(std::min(settings.rounds, 3));
    const Job& j = *jobs.front();
    const double speed = 1e3 * span / race.minimum_ms(j.job), error = std::abs(j.result.psi / psi - 1);
    const Counters& counters = j.result.counters;
    report.text += fmt::format("  {:<11}{:<8}{:<7}{:>8.0e}{:>10.1f}{:>9.1f}{}{:>8}{:>11}{:>10.1e}{:>11}\n",
                               c.formulation, c.integrator, c.multistep, j.problem.solver.rtol, race.minimum_ms(j.job),
                               speed, speed >= kRealTime ? ' ' : '!', counters.steps, callbacks(counters), error,
                               fmt::format("({:.1e})", std::abs(psi / index1 - 1)));
    rows.push_back({{"formulation", c.formulation},
                    {"integrator", c.integrator},
                    {"multistep", c.multistep},
                    {"rtol", j.problem.solver.rtol},
                    {"ms", race.minimum_ms(j.job)},
                    {"simulated_s_per_s", speed},
                    {"psi_error", error},
                    {"counters", counters_json(counters)}});
  }
  report.json["against_real_time"] = {{"target", kRealTime}, {"psi_error", kPsiError}, {"rows", std::move(rows)}};
}

bool ends_with_one_of(std::string_view text, std::initializer_list<std::string_view> ends) {
  return std::any_of(ends.begin(), ends.end(), [&](std::string_view e) { return text.ends_with(e); });
}

/// 100 numbers of the vehicle by path: all masses and moments of inertia, the stiffnesses, dampers and tyres of all
/// corners, and of the attachment points as many as are left to choose.
std::vector<std::string> many_numbers(const Mechanism& mechanism) {
  struct Group {
    std::string_view begins;
    std::initializer_list<std::string_view> ends;
  };
  const Group groups[] = {
      {"rigid_body.", {".mass_kg", ".inertia_xx_kg_m2", ".inertia_yy_kg_m2", ".inertia_zz_kg_m2"}},
      {"rotor.", {".inertia_kg_m2"}},
      {"axis_spring.", {".stiffness_N_per_m"}},
      {"spring.", {".spring_law.slope", ".damper_law.slope"}},
      {"tyre.", {".stiffness_N_per_m", ".calspan.A1", ".calspan.A2", ".calspan.A3"}},
      {"point.strut_", {".x_m", ".y_m", ".z_m"}},
      {"point.leaf_", {".x_m", ".y_m", ".z_m"}},
  };
  std::vector<std::string> chosen;
  for (const Group& g : groups)
    for (const Number& n : mechanism.numbers())
      if (chosen.size() < kMany && n.fixed_because.empty() && n.value != 0 && n.path.starts_with(g.begins) &&
          ends_with_one_of(n.path, g.ends))
        chosen.push_back(n.path);
  return chosen;
}

void against_simulation(const Settings& settings, Report& report) {
  const Scene scene = double_lane_change();
  const std::vector<std::string> numbers = many_numbers(*scene.mechanism());
  Problem few = make_problem(scene), many = make_problem(scene, numbers);
  if (settings.quick) few.solver.t_end = many.solver.t_end = 1;
  const double rtol = few.solver.rtol;
  report.text += fmt::format(
      "\nAdjoint gradients of the double lane change, {} s, rtol {:g}, each with its forward run. /sim: times a "
      "simulation (target\n<= {:g} with {} parameters); /few: times the gradient of {} (target <= {:g})\n"
      "  {:<11}{:<16}{:<7}{:>11}{:>10}{:>9}{:>9}{:>8}{:>8}{:>11}\n",
      few.solver.t_end, rtol, kSimulations, few.parameters.size(), few.parameters.size(), kManyOverFew, "", "", "",
      "parameters", "ms", "/sim", "/few", "steps", "back", "callbacks");
  nlohmann::json rows = nlohmann::json::array();
  for (const Case& c : kCases) {
    Race race;
    Jobs jobs;
    const std::string method = c.integrator + std::string("-adjoint");
    const int simulation = add(race, jobs, with(few, c, rtol), "").job;
    const int first = add(race, jobs, with(few, c, rtol), method).job;
    const int last = add(race, jobs, with(many, c, rtol), method).job;
    // Our own derivation, on its own integrator: the penalty's is the method of the source.
    if (std::string_view(c.multistep) != "adams") add(race, jobs, with(few, c, rtol), "hand-adjoint");
    race.run(std::min(settings.rounds, 3));
    for (const auto& j : jobs) {
      const bool plain = j->method.empty();
      const double s = race.ratio(j->job, simulation), f = race.ratio(j->job, first);
      const int parameters = plain ? 0 : j->problem.parameters.size();
      const bool is_many = j->job == last;
      const std::string over_simulation =
                            plain ? "" : fmt::format("{:.2f}{}", s, is_many || s <= kSimulations ? ' ' : '!'),
                        over_few = is_many ? fmt::format("{:.2f}{}", f, f <= kManyOverFew ? ' ' : '!') : "";
      const Counters& counters = j->result.counters;
      report.text +=
          fmt::format("  {:<11}{:<16}{:<7}{:>11}{:>10.1f}{:>9}{:>9}{:>8}{:>8}{:>11}\n", c.formulation,
                      plain ? "simulation" : j->method, c.multistep, parameters, race.minimum_ms(j->job),
                      over_simulation, over_few, counters.steps, counters.backward_steps, callbacks(counters));
      rows.push_back({{"formulation", c.formulation},
                      {"method", plain ? "simulation" : j->method},
                      {"multistep", c.multistep},
                      {"parameters", parameters},
                      {"ms", race.minimum_ms(j->job)},
                      {"over_simulation", s},
                      {"over_few", is_many ? nlohmann::json(f) : nlohmann::json()},
                      {"counters", counters_json(counters)}});
    }
  }
  report.json["against_simulation"] = {{"rtol", rtol}, {"numbers", numbers}, {"rows", std::move(rows)}};
}

double seconds_of(const std::function<void()>& job) {
  const double begin = processor_time_s();
  job();
  return processor_time_s() - begin;
}

/// The start apart from the steps: a run that ends at once, and one that does not.
void against_vehicles(const Settings& settings, Report& report) {
  constexpr double kEnd = 0.5, kAtOnce = 1e-6, kTolerance = 1e-5;
  const Scene one = double_lane_change();
  const std::vector<int> counts = settings.quick ? std::vector<int>{1, 2} : std::vector<int>{1, 10, 100};
  report.text += fmt::format(
      "\nUncoupled vehicles in one scene, {} s, rtol {:g}, one core: reading the scene, the start (equilibrium, first "
      "derivatives), and\nthen the time of a step and of a callback; exponent: of the growth of the time of a step "
      "since the row above\n  {:<11}{:<8}{:<5}{:>9}{:>12}{:>10}{:>10}{:>8}{:>11}{:>10}{:>10}{:>10}\n",
      kEnd, kTolerance, "", "", "", "vehicles", "coordinates", "read ms", "start ms", "steps", "callbacks", "step ms",
      "call us", "exponent");
  nlohmann::json rows = nlohmann::json::array();
  for (const Case& c : {kCases[0], kCases[1]}) {
    std::optional<double> last;
    int last_count = 0;
    for (const int count : counts) {
      std::optional<Problem> base;
      const double read = seconds_of([&] { base = make_problem(make_fleet(one, count)); });
      Race race;
      Jobs jobs;
      Problem p = with(*base, c, kTolerance);
      p.solver.t_end = kAtOnce;
      const Job& start = add(race, jobs, p, "");
      p.solver.t_end = kEnd;
      const Job& run = add(race, jobs, p, "");
      race.run(count > 10 ? 1 : std::min(settings.rounds, 3));
      const long steps = run.result.counters.steps - start.result.counters.steps,
                 calls = callbacks(run.result.counters) - callbacks(start.result.counters);
      const double ms = race.minimum_ms(run.job) - race.minimum_ms(start.job);
      const double step = ms / static_cast<double>(steps), call = 1e3 * ms / static_cast<double>(calls);
      std::optional<double> exponent;
      if (last) exponent = std::log(step / *last) / std::log(static_cast<double>(count) / last_count);
      report.text += fmt::format("  {:<11}{:<8}{:<5}{:>9}{:>12}{:>10.1f}{:>10.1f}{:>8}{:>11}{:>10.3f}{:>10.1f}{:>10}\n",
                                 c.formulation, c.integrator, c.multistep, count, p.mechanism->coordinate_count(),
                                 1e3 * read, race.minimum_ms(start.job), steps, calls, step, call,
                                 exponent ? fmt::format("{:.3f}", *exponent) : "");
      rows.push_back({{"formulation", c.formulation},
                      {"integrator", c.integrator},
                      {"vehicles", count},
                      {"coordinates", p.mechanism->coordinate_count()},
                      {"read_ms", 1e3 * read},
                      {"start_ms", race.minimum_ms(start.job)},
                      {"steps", steps},
                      {"callbacks", calls},
                      {"step_ms", step},
                      {"callback_us", call},
                      {"psi", run.result.psi},
                      {"exponent", exponent ? nlohmann::json(*exponent) : nlohmann::json()}});
      last = step;
      last_count = count;
    }
  }
  report.json["against_vehicles"] = {{"t_end_s", kEnd}, {"rtol", kTolerance}, {"rows", std::move(rows)}};
}

}  // namespace

Report vehicle_speed(const Settings& settings) {
  Report report;
  against_real_time(settings, report);
  return report;
}

Report vehicle_gradients(const Settings& settings) {
  Report report;
  against_simulation(settings, report);
  return report;
}

Report vehicle_number(const Settings& settings) {
  Report report;
  against_vehicles(settings, report);
  return report;
}

Report vehicle(const Settings& settings) {
  Report report;
  against_real_time(settings, report);
  against_simulation(settings, report);
  against_vehicles(settings, report);
  return report;
}

}  // namespace costate::bench
