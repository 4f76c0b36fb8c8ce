// Every gradient method on the five-bar at four tolerances, all in one interleaved race with the plain simulations on
// the same integrator and with the program by hand. Targets: below 3 simulations, below 1.5 programs by hand.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "benchmark.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"
#include "curve.h"
#include "five_bar.h"
#include "five_bar_by_hand.h"

namespace costate::bench {

namespace {

constexpr double kSimulations = 3, kByHand = 1.5;  // targets

struct Entry {
  std::string formulation, method, multistep;  // "baumgarte", "cvodes-adjoint", "adams" (or empty)
  Problem problem;
  bool plain = false;  // a simulation
  int job = -1, simulation = -1;
  GradientResult result;
};

struct HandEntry {
  Multistep multistep;
  bool plain;
  int job = -1;
  ByHandResult result;
};

struct Case {
  const char *formulation, *integrator, *multistep;
};
constexpr Case kCases[] = {
    {"index1", "idas", ""},         {"index2", "idas", ""},         {"baumgarte", "cvodes", "adams"},
    {"baumgarte", "cvodes", "bdf"}, {"penalty", "cvodes", "adams"}, {"penalty", "cvodes", "bdf"},
    {"baumgarte", "dopri5", ""},    {"baumgarte", "dop853", ""},    {"maggi", "dop853", ""}};

/// All jobs at one tolerance.
class Round {
 public:
  Round(double rtol, int rounds) : rtol_(rtol) {
    for (const Multistep m : {Multistep::bdf, Multistep::adams})
      for (const bool plain : {true, false}) {
        HandEntry& e = *hand.emplace_back(std::make_unique<HandEntry>(HandEntry{m, plain, -1, {}}));
        e.job = race_.add([&e, rtol] {
          e.result = e.plain ? simulate_by_hand(rtol, e.multistep) : gradient_by_hand(rtol, e.multistep);
        });
      }
    for (const Case& c : kCases) {
      const int simulation = add(c, "", -1);
      const bool discrete = find_integrator(c.integrator).discrete;
      for (const char* direction : {discrete ? "-tangent" : "-forward", "-adjoint"})
        add(c, (discrete ? std::string("discrete") : c.integrator) + direction, simulation);
    }
    race_.run(rounds);
  }

  double ms(int job) const { return race_.minimum_ms(job); }
  double median_ms(int job) const { return 1e3 * race_.timing(job).median_s; }
  double ratio(int job, int reference) const { return race_.ratio(job, reference); }
  const HandEntry& by_hand(Multistep m, bool plain) const {
    return *hand[(m == Multistep::bdf ? 0 : 2) + (plain ? 0 : 1)];
  }

  std::vector<std::unique_ptr<Entry>> entries;
  std::vector<std::unique_ptr<HandEntry>> hand;

 private:
  int add(const Case& c, const std::string& method, int simulation) {
    Entry& e = *entries.emplace_back(std::make_unique<Entry>());
    e.formulation = c.formulation;
    e.method = method.empty() ? std::string(c.integrator) + " simulation" : method;
    e.multistep = find_integrator(c.integrator).discrete && !method.empty() ? c.integrator : c.multistep;
    e.plain = method.empty();
    e.simulation = simulation;
    e.problem = make_five_bar();
    e.problem.formulation = c.formulation;
    e.problem.solver.integrator = c.integrator;
    e.problem.solver.rtol = rtol_;
    e.problem.solver.confirm = false;
    if (*c.multistep != 0) e.problem.solver.cvodes_method = c.multistep;
    const std::vector<double> rho = e.problem.parameters.values();
    e.job = race_.add([&e, rho] {
      e.result = e.plain ? GradientResult(simulate(e.problem, rho)) : gradient(e.problem, e.method, rho);
    });
    return e.job;
  }

  double rtol_;
  Race race_;
};

}  // namespace

Report gradients(const Settings& settings) {
  std::vector<double> tolerances = {1e-4, 1e-6, 1e-8, 1e-10};
  if (settings.quick) tolerances = {1e-6};
  std::vector<std::unique_ptr<Round>> all;
  for (const double rtol : tolerances) all.push_back(std::make_unique<Round>(rtol, settings.rounds));

  Curve curve;
  for (const auto& r : all) {
    const HandEntry& e = r->by_hand(Multistep::bdf, false);
    curve.add(gradient_error(e.result.gradient), r->ms(e.job));
  }

  Report report;
  report.json["targets"] = {{"simulations", kSimulations}, {"by_hand", kByHand}};
  report.json["rows"] = nlohmann::json::array();
  std::string& text = report.text;
  text = fmt::format(
      "Gradients of the five-bar, 5 s, 2 parameters, each with its forward run; processor time, minimum of {} "
      "interleaved rounds.\n/sim: times a simulation on the same integrator (target < {}); /hand: times the adjoint by "
      "hand, CVODES BDF, same rtol (target < {});\n/hand at error: the same where that program makes this row's "
      "error.\n",
      settings.rounds, kSimulations, kByHand);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Round& r = *all[i];
    const HandEntry& reference = r.by_hand(Multistep::bdf, false);
    text += fmt::format("\nrtol {:g}\n  {:<11}{:<18}{:<7}{:>9}{:>9}{:>7}{:>7}{:>10}{:>10}{:>10}{:>8}{:>8}{:>7}{:>10}\n",
                        tolerances[i], "", "", "", "ms", "median", "/sim", "/hand", "at error", "psi err", "grad err",
                        "steps", "back", "factor", "callbacks");
    for (const auto& e : r.hand) {
      const char* multistep = e->multistep == Multistep::bdf ? "bdf" : "adams";
      const double error = e->plain ? 0 : gradient_error(e->result.gradient);
      const double over = r.ratio(e->job, r.by_hand(e->multistep, true).job);
      text += fmt::format("  {:<11}{:<18}{:<7}{:>9.3f}{:>9.3f}{:>7}{:>7}{:>10}{:>10.1e}{:>10}{:>8}{:>8}{:>7}{:>10}\n",
                          "by hand", e->plain ? "simulation" : "adjoint", multistep, r.ms(e->job), r.median_ms(e->job),
                          e->plain ? "" : fmt::format("{:.2f}", over),
                          e->plain ? "" : fmt::format("{:.2f}", r.ratio(e->job, reference.job)), "",
                          psi_error(e->result.psi), e->plain ? "" : fmt::format("{:.1e}", error), e->result.steps,
                          e->result.backward_steps, "", e->result.evaluations + e->result.jacobians);
      report.json["rows"].push_back({{"rtol", tolerances[i]},
                                     {"program", "by hand"},
                                     {"method", e->plain ? "simulation" : "adjoint"},
                                     {"multistep", multistep},
                                     {"ms", r.ms(e->job)},
                                     {"median_ms", r.median_ms(e->job)},
                                     {"over_simulation", e->plain ? nlohmann::json() : nlohmann::json(over)},
                                     {"psi_error", psi_error(e->result.psi)},
                                     {"gradient_error", e->plain ? nlohmann::json() : nlohmann::json(error)},
                                     {"steps", e->result.steps},
                                     {"backward_steps", e->result.backward_steps}});
    }
    for (const auto& e : r.entries) {
      const Counters& c = e->result.counters;
      nlohmann::json row = {{"rtol", tolerances[i]},
                            {"program", "costate"},
                            {"formulation", e->formulation},
                            {"method", e->method},
                            {"multistep", e->multistep},
                            {"ms", r.ms(e->job)},
                            {"median_ms", r.median_ms(e->job)},
                            {"psi_error", psi_error(e->result.psi)},
                            {"counters", counters_json(c)}};
      std::string simulations, by_hand, at_error, error;
      if (!e->plain) {
        const double s = r.ratio(e->job, e->simulation), h = r.ratio(e->job, reference.job),
                     g = gradient_error(e->result.gradient);
        const std::optional<double> same = curve.ms_at(g);
        simulations = fmt::format("{:.2f}{}", s, s < kSimulations ? ' ' : '!');
        by_hand = fmt::format("{:.2f}{}", h, h < kByHand ? ' ' : '!');
        at_error = same ? fmt::format("{:.2f}", r.ms(e->job) / *same) : "";
        error = fmt::format("{:.1e}", g);
        row["over_simulation"] = s;
        row["over_hand"] = h;
        row["over_hand_at_error"] = same ? nlohmann::json(r.ms(e->job) / *same) : nlohmann::json();
        row["gradient_error"] = g;
      }
      text += fmt::format("  {:<11}{:<18}{:<7}{:>9.3f}{:>9.3f}{:>7}{:>7}{:>10}{:>10.1e}{:>10}{:>8}{:>8}{:>7}{:>10}\n",
                          e->formulation, e->method, e->multistep, r.ms(e->job), r.median_ms(e->job), simulations,
                          by_hand, at_error, psi_error(e->result.psi), error, c.steps, c.backward_steps,
                          c.factorizations, callbacks(c));
      report.json["rows"].push_back(std::move(row));
    }
  }
  return report;
}

}  // namespace costate::bench
