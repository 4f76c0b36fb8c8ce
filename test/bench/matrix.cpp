// Every formulation by every method that it can be run with, at three tolerances: what it cost and how exact it was.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "benchmark.h"
#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"
#include "model.h"

namespace costate::bench {

namespace {

struct Timed {
  GradientResult result;
  double ms = 0;
  std::string failure;
};

/// Once, and up to `rounds` times as long as that takes no longer than a second altogether.
template <class Job>
Timed timed(int rounds, Job&& job) {
  Timed t;
  double spent = 0;
  try {
    for (int k = 0; k < rounds && spent < 1; ++k) {
      const double before = processor_time_s();
      t.result = job();
      const double s = processor_time_s() - before;
      spent += s;
      t.ms = k == 0 ? 1e3 * s : std::min(t.ms, 1e3 * s);
    }
  } catch (const Error& e) {
    t.failure = e.what();
  }
  return t;
}

void table(const Model& model, double rtol, int rounds, Report& report) {
  report.text +=
      fmt::format("\n{}, rtol {:g}\n  {:<22}{:<18}{:>7}{:>8}{:>8}{:>10}{:>10}{:>7}{:>10}{:>10}\n", model.name, rtol, "",
                  "", "steps", "back", "factor", "callbacks", "ms", "/sim", "psi err", "grad err");
  for (const Formulation& f : formulations()) {
    Problem p = model.problem;
    p.formulation = f.name;
    p.solver.rtol = rtol;
    p.solver.confirm = false;
    p.solver.integrator = "";
    const std::vector<double> rho = p.parameters.values();
    const auto add = [&](const std::string& method, const Timed& t, const Timed& simulation) {
      nlohmann::json row = {{"scene", model.name}, {"rtol", rtol}, {"formulation", f.name}, {"method", method}};
      if (!t.failure.empty()) {
        report.text += fmt::format("  {:<22}{:<18}{}\n", f.name, method, t.failure.substr(0, 80));
        row["failure"] = t.failure;
      } else {
        const Counters& c = t.result.counters;
        const bool plain = t.result.gradient.empty();
        const double ratio = t.ms / simulation.ms, psi = model.psi_error(t.result.psi);
        report.text += fmt::format("  {:<22}{:<18}{:>7}{:>8}{:>8}{:>10}{:>10.2f}{:>7.2f}{:>10.1e}{:>10}\n", f.name,
                                   method, c.steps, c.backward_steps, c.factorizations, callbacks(c), t.ms, ratio, psi,
                                   plain ? "" : fmt::format("{:.1e}", model.gradient_error(t.result.gradient)));
        row["counters"] = counters_json(c);
        row["ms"] = t.ms;
        row["over_simulation"] = ratio;
        row["psi_error"] = psi;
        row["gradient_error"] = plain ? nlohmann::json() : nlohmann::json(model.gradient_error(t.result.gradient));
      }
      report.json["rows"].push_back(std::move(row));
    };
    const Timed plain = timed(rounds, [&] { return GradientResult(simulate(p, rho)); });
    add("simulation", plain, plain);
    for (const SensitivityMethod& m : sensitivity_methods()) {
      if (m.needs == SensitivityMethod::Needs::either || !refusal(m, f).empty()) continue;
      // Against a simulation by the same integrator.
      const std::string integrator = integrator_of(p, m);
      Timed simulation = plain;
      if (integrator != f.default_integrator) {
        Problem own = p;
        own.solver.integrator = integrator;
        simulation = timed(rounds, [&] { return GradientResult(simulate(own, rho)); });
      }
      add(m.name, timed(rounds, [&] { return gradient(p, m.name, rho); }), simulation);
    }
  }
}

}  // namespace

Report matrix(const Settings& settings) {
  Report report;
  report.json["rows"] = nlohmann::json::array();
  report.text =
      "Every formulation by every method: processor time, times that of a simulation by the same integrator, "
      "errors against reference.json.\n";
  std::vector<double> tolerances = {1e-5, 1e-7, 1e-9};
  if (settings.quick) tolerances = {1e-5};
  for (const char* scene : {"five_bar/five_bar.toml", "andrews/andrews.toml"}) {
    const Model model = load_model(scene);
    for (const double rtol : tolerances) table(model, rtol, settings.rounds, report);
  }
  return report;
}

}  // namespace costate::bench
