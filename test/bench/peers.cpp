// Costate against other programs, all of them in one interleaved race: every program at a ladder of tolerances gives a
// curve of time over error, and the curves are compared at equal error. An error counts from where no tighter tolerance
// makes a larger one. Processor time, medians.
#include <fmt/format.h>

#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <optional>

#include "benchmark.h"
#include "chain.h"
#include "chain_simbody.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"
#include "curve.h"
#include "five_bar.h"
#include "five_bar_by_hand.h"

namespace costate::bench {

namespace {

constexpr double kTimesFaster = 3;  // the aim for gradients

struct Program {
  std::string name;
  bool peer = false;
  std::function<double(double rtol)> run;  // returns the error
  std::vector<int> jobs;
  std::deque<double> errors;  // a job writes its own; places stay
  Curve curve;
};

/// What a run of Costate is set to.
struct Setting {
  const char *formulation, *integrator, *method, *multistep;
};

std::string name_of(const Setting& s) {
  std::string name = fmt::format("{} {}", s.formulation, *s.method ? s.method : s.integrator);
  if (*s.method != 0 && find_integrator(s.integrator).discrete) name += fmt::format(" {}", s.integrator);
  if (*s.multistep != 0) name += fmt::format(" {}", s.multistep);
  return name;
}

Problem set(Problem p, const Setting& s, double rtol) {
  p.formulation = s.formulation;
  p.solver.integrator = s.integrator;
  p.solver.confirm = false;
  p.solver.rtol = rtol;
  if (*s.multistep != 0) p.solver.cvodes_method = s.multistep;
  return p;
}

class Comparison {
 public:
  Comparison(std::string title, double aim) : title_(std::move(title)), aim_(aim) {}

  void add(std::string name, bool peer, std::function<double(double)> run) {
    Program& p = programs_.emplace_back();
    p.name = std::move(name);
    p.peer = peer;
    p.run = std::move(run);
  }

  /// A tolerance at which a program fails is left out of its curve.
  void race(const std::vector<double>& tolerances, int rounds) {
    Race race;
    for (Program& p : programs_)
      for (const double rtol : tolerances) {
        double* error = &p.errors.emplace_back(0);
        p.jobs.push_back(race.add([&p, rtol, error] {
          try {
            *error = p.run(rtol);
          } catch (const std::exception&) {
            *error = std::numeric_limits<double>::quiet_NaN();
          }
        }));
      }
    race.run(rounds);
    for (Program& p : programs_) {
      for (std::size_t k = 0; k < tolerances.size(); ++k)
        if (std::isfinite(p.errors[k]) && p.errors[k] > 0)
          p.curve.add(p.errors[k], 1e3 * race.timing(p.jobs[k]).median_s);
      p.curve.without_luck();
    }
  }

  void report(const std::vector<double>& errors, Report& report) const {
    report.text += fmt::format("\n{}: ms at error\n  {:<42}", title_, "");
    for (const double e : errors) report.text += fmt::format("{:>9.0e}", e);
    report.text += '\n';
    nlohmann::json json = {{"errors", errors}, {"programs", nlohmann::json::array()}};
    const auto row = [&](const std::string& name, const std::vector<std::optional<double>>& values, const char* kind) {
      report.text += fmt::format("  {:<42}", name);
      nlohmann::json list = nlohmann::json::array();
      for (const auto& v : values) {
        report.text += v ? fmt::format("{:>9.3g}", *v) : fmt::format("{:>9}", "-");
        list.push_back(v ? nlohmann::json(*v) : nlohmann::json());
      }
      report.text += '\n';
      json["programs"].push_back({{"name", name}, {"kind", kind}, {"values", std::move(list)}});
    };
    std::vector<std::optional<double>> best[2];  // ours, a peer's
    for (auto& b : best) b.resize(errors.size());
    for (const bool peer : {true, false})
      for (const Program& p : programs_) {
        if (p.peer != peer) continue;
        std::vector<std::optional<double>> ms;
        for (std::size_t k = 0; k < errors.size(); ++k) {
          ms.push_back(p.curve.ms_within(errors[k]));
          auto& b = best[peer ? 1 : 0][k];
          if (ms.back() && (!b || *ms.back() < *b)) b = ms.back();
        }
        row(p.name, ms, peer ? "peer" : "costate");
      }
    std::vector<std::optional<double>> ratios(errors.size());
    int reached = 0, compared = 0;
    for (std::size_t k = 0; k < errors.size(); ++k)
      if (best[0][k] && best[1][k]) {
        ratios[k] = *best[1][k] / *best[0][k];
        ++compared;
        if (*ratios[k] >= aim_) ++reached;
      }
    row("best peer / best of Costate", ratios, "ratio");
    for (const Program& p : programs_)
      for (const double e : p.errors)
        if (!std::isfinite(e)) report.text += fmt::format("  {} failed at one of its tolerances\n", p.name);
    report.text += fmt::format("  aim: {:g}; reached at {} of {} errors\n", aim_, reached, compared);
    json["aim"] = aim_;
    report.json[title_] = std::move(json);
  }

 private:
  std::string title_;
  double aim_;
  std::deque<Program> programs_;
};

void five_bar_gradients(const Settings& settings, Report& report) {
  Comparison c("Gradient of the five-bar, 5 s, 2 parameters", kTimesFaster);
  c.add("by hand on CVODES, BDF", true,
        [](double rtol) { return gradient_error(gradient_by_hand(rtol, Multistep::bdf).gradient); });
  c.add("by hand on CVODES, Adams", true,
        [](double rtol) { return gradient_error(gradient_by_hand(rtol, Multistep::adams).gradient); });
  c.add("by hand on IDAS, index 1", true, [](double rtol) { return gradient_error(gradient_by_idas(rtol).gradient); });
#ifdef COSTATE_BENCH_PETSC
  for (const char* scheme : {"5dp", "8vr"})
    c.add(fmt::format("by hand on PETSc, TSAdjoint {}", scheme), true,
          [scheme](double rtol) { return gradient_error(gradient_by_petsc(rtol, scheme).gradient); });
#else
  report.text += "PETSc was not found.\n";
#endif
  static constexpr Setting kSettings[] = {
      {"baumgarte", "cvodes", "cvodes-adjoint", "adams"}, {"baumgarte", "dopri5", "discrete-adjoint", ""},
      {"baumgarte", "dop853", "discrete-adjoint", ""},    {"maggi", "dop853", "discrete-adjoint", ""},
      {"baumgarte", "radau9", "discrete-adjoint", ""},    {"index2", "radau9", "discrete-adjoint", ""}};
  const Problem problem = make_five_bar();
  const std::vector<double> rho = problem.parameters.values();
  for (const Setting& s : kSettings)
    c.add(name_of(s), false, [&s, &problem, rho](double rtol) {
      return gradient_error(gradient(set(problem, s, rtol), s.method, rho).gradient);
    });
  std::vector<double> tolerances = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12};
  if (settings.quick) tolerances = {1e-4, 1e-6};
  c.race(tolerances, settings.rounds);
  c.report({1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}, report);
}

void chain_runs(const std::string& title, const Problem& problem, int bars, bool spatial, const Settings& settings,
                Report& report) {
  static constexpr Setting kSettings[] = {{"baumgarte", "cvodes", "", "adams"},
                                          {"baumgarte", "dop853", "", ""},
                                          {"maggi", "dop853", "", ""},
                                          {"index1", "idas", "", ""}};
  Comparison c(title, 1);
  const std::vector<double> rho = problem.parameters.values();
  // By coordinates and a scheme that none of the others uses.
  const double reference = simulate(set(problem, {"maggi", "cvodes", "", "adams"}, 1e-13), rho).psi;
  const auto error = [reference](double psi) { return std::abs(psi / reference - 1); };
  for (const Setting& s : kSettings)
    c.add(name_of(s), false,
          [&s, &problem, rho, error](double rtol) { return error(simulate(set(problem, s, rtol), rho).psi); });
#ifdef COSTATE_BENCH_SIMBODY
  const SimbodyChain simbody(bars, spatial);
  const double t_end = problem.solver.t_end;
  for (const char* integrator : {"merson", "feldberg"})
    c.add(fmt::format("Simbody, {}", integrator), true, [&simbody, integrator, t_end, error](double rtol) {
      return error(simbody.run(rtol, integrator, t_end).psi);
    });
#else
  static_cast<void>(bars);
  static_cast<void>(spatial);
  report.text += "Simbody was not found.\n";
#endif
  std::vector<double> tolerances = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11};
  if (settings.quick) tolerances = {1e-4, 1e-6};
  c.race(tolerances, std::min(settings.rounds, 5));
  c.report({1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}, report);
}

}  // namespace

Report peers(const Settings& settings) {
  Report report;
  report.text = fmt::format(
      "Against other programs: processor time, medians of interleaved rounds, at equal error by straight lines through "
      "each program's\nruns in log-log. Simbody has no sensitivities: a gradient of n parameters is n or 2 n more of "
      "its "
      "runs, and differences.\n");
  five_bar_gradients(settings, report);
  chain_runs("Chain of 10 bars, 1 s, psi", make_chain(10, 0), 10, false, settings, report);
  if (!settings.quick) chain_runs("Chain of 40 bars, 1 s, psi", make_chain(40, 0), 40, false, settings, report);
  chain_runs("Spatial chain of 10 bodies, 1 s, psi", make_spatial_chain(10), 10, true, settings, report);
  return report;
}

}  // namespace costate::bench
