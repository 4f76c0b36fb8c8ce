// costate cycle: the limit cycle or periodic motion of a scene, its multipliers, and how it depends on the parameters.
#include "costate/cycle/cycle.h"

#include <fmt/format.h>

#include <chrono>

#include "accuracy.h"
#include "command.h"
#include "costate/base/notice.h"
#include "costate/cycle/cycle_errors.h"
#include "cycle_accuracy.h"
#include "cycle_branch.h"
#include "digits.h"
#include "run_pages.h"
#include "trajectory.h"

namespace costate::app {

namespace {

struct CycleFlags {
  std::string section, travel, follow;
  std::vector<std::string> relabel;
  std::optional<double> period, after;
  std::optional<int> settle, count;
  bool no_estimate = false, no_derivatives = false, report = false;
  int max_points = 300;
  AccuracyOption accuracy;

  /// What they say, written over the scene's [cycle].
  void add_to(std::vector<std::string>& overrides) const {
    const auto quoted = [](const std::string& text) { return Json(text).dump(); };
    if (!section.empty()) overrides.push_back("cycle.section=" + quoted(section));
    if (period) overrides.push_back(fmt::format("cycle.period_s={}", *period));
    if (after) overrides.push_back(fmt::format("cycle.after_s={}", *after));
    if (settle) overrides.push_back(fmt::format("cycle.settle={}", *settle));
    if (count) overrides.push_back(fmt::format("cycle.count={}", *count));
    if (!travel.empty()) overrides.push_back("cycle.travel=" + quoted(travel));
    for (const auto& pair : relabel) {
      const std::size_t equals = pair.find('=');
      if (equals == std::string::npos || equals == 0 || equals + 1 == pair.size())
        throw Error(fmt::format("--relabel needs NAME=NAME, found '{}'. Example: --relabel left=right.", pair));
      overrides.push_back("cycle.relabel." + pair.substr(0, equals) + "=" + quoted(pair.substr(equals + 1)));
    }
  }
};

/// What is known of a number that has no estimate: the tolerance's own digits.
double uncertainty(double value, double error, const Problem& p) {
  return std::max(error, p.solver.rtol * std::abs(value) + p.solver.absolute());
}

std::string verdict(const CycleResult& r) {
  if (r.multipliers.empty()) return "  no multipliers: nothing is left free at the section\n";
  const auto stable = r.stable();
  const double m = r.largest();
  if (!stable)
    return fmt::format(
        "  stability is not decided: the largest multiplier is 1 within {:.1e}, which it may be off by\n", r.undecided);
  if (*stable)
    return fmt::format("  stable: a disturbance is {} after each cycle\n",
                       m < 1e-6 ? std::string("gone") : fmt::format("{:.3g} of what it was", m));
  return fmt::format("  NOT STABLE: a disturbance is {} times what it was after each cycle\n",
                     m < 1.01 ? known_digits(m, std::min(r.undecided, 1e-3 * (m - 1))) : fmt::format("{:.3g}", m));
}

std::string multiplier_text(const std::complex<double>& m, double error) {
  const double u = std::max(error, 1e-12);
  if (std::abs(m) <= u) return fmt::format("0 within {:.1e}", u);
  if (m.imag() == 0) return known_digits(m.real(), u);
  return fmt::format("{} {} {} i   modulus {}", known_digits(m.real(), u), m.imag() < 0 ? '-' : '+',
                     known_digits(std::abs(m.imag()), u), known_digits(std::abs(m), u));
}

Json named_rows(const std::vector<std::string>& names, const Eigen::MatrixXd& rows,
                const std::vector<std::string>& columns) {
  Json j = Json::object();
  for (std::size_t i = 0; i < names.size(); ++i) {
    Json row = Json::object();
    for (std::size_t k = 0; k < columns.size(); ++k)
      row[columns[k]] = rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
    j[names[i]] = row;
  }
  return j;
}

Json cycle_json(const Setup& setup, const CycleResult& r, double wall) {
  const auto parameters = setup.problem.parameters.names();
  Json j;
  j["psi"] = r.psi.value;
  j["psi_error"] = r.psi.error;
  j["parameters"] = named(parameters, setup.rho);
  j["gradient"] = nullptr;
  j["fixed_point"] = named(r.state_names, r.state);
  j["section_coordinates"] = named(r.names, {r.x.data(), r.x.data() + r.x.size()});
  j["section_errors"] = named(r.names, {r.x_error.data(), r.x_error.data() + r.x_error.size()});
  j["period_s"] = r.period.value;
  j["period_error_s"] = r.period.error;
  if (!setup.scene.cycle->travel.empty()) {
    j["travel_m"] = r.travel.value;
    j["speed_m_per_s"] = r.speed();
  }
  j["multipliers"] = Json::array();
  for (const auto& m : r.multipliers) j["multipliers"].push_back({m.real(), m.imag()});
  j["multiplier_error"] = r.multiplier_error;
  const auto stable = r.stable();
  j["stable"] = stable ? Json(*stable) : Json(nullptr);
  j["residual"] = r.residual;
  j["residual_of"] = r.worst;
  j["iterations"] = r.iterations;
  j["events"] = Json::array();
  for (const RunEvent& e : r.events)
    j["events"].push_back({{"t", e.t}, {"name", e.name}, {"mode", e.mode}, {"jump", e.jump}});
  if (r.x_rho.size() > 0) {
    const auto list = [](const Eigen::VectorXd& v) { return std::vector<double>(v.data(), v.data() + v.size()); };
    j["gradient"] = named(parameters, list(r.psi_rho));
    j["period_gradient"] = named(parameters, list(r.period_rho));
    if (!setup.scene.cycle->travel.empty()) j["speed_gradient"] = named(parameters, list(r.speed_rho()));
    const auto errors = [&](const char* key, const Eigen::VectorXd& of) {
      j[key] = of.size() > 0 ? named(parameters, list(of)) : Json(nullptr);
    };
    errors("gradient_error", r.psi_rho_error);
    errors("period_gradient_error", r.period_rho_error);
    if (!setup.scene.cycle->travel.empty()) errors("speed_gradient_error", r.speed_rho_error);
    j["fixed_point_gradient_error"] =
        r.x_rho_error.size() > 0 ? named_rows(r.names, r.x_rho_error, parameters) : Json(nullptr);
    const bool known = r.multiplier_rho.size() > 0;
    j["multiplier_gradient"] = known ? named(parameters, list(r.multiplier_rho)) : Json(nullptr);
    j["multiplier_gradient_error"] = known ? named(parameters, list(r.multiplier_rho_error)) : Json(nullptr);
    j["multiplier_gradient_method"] = r.multiplier_method;
    j["fixed_point_gradient"] = named_rows(r.names, r.x_rho, parameters);
  }
  j["formulation"] = setup.problem.formulation;
  j["integrator"] = r.integrator;
  j["rtol"] = setup.problem.solver.rtol;
  j["counters"] = counters_json(r.counters);
  j["wall_s"] = wall;
  j["status"] = "ok";
  j["warnings"] = warnings_of(setup);
  j["settings"] = settings_json(setup);
  return j;
}

std::string cycle_text(const Setup& setup, const CommonOptions& common, const CycleResult& r, double wall) {
  const Problem& p = setup.problem;
  std::string text = fmt::format("{}\n", setup.scene.title.empty() ? common.scene : setup.scene.title);
  text += fmt::format("  {} on {}, rtol {:g}: returns within {:.2g} tolerances after {} iteration{}\n", p.formulation,
                      r.integrator, p.solver.rtol, r.residual, r.iterations, r.iterations == 1 ? "" : "s");
  text += fmt::format("  period {} s", known_digits(r.period.value, uncertainty(r.period.value, r.period.error, p)));
  if (!setup.scene.cycle->travel.empty())
    text +=
        fmt::format(", {} m at {} m/s", known_digits(r.travel.value, uncertainty(r.travel.value, r.travel.error, p)),
                    known_digits(r.speed(), uncertainty(r.speed(), std::max(r.period.error, r.travel.error), p)));
  text += "\n";
  const bool costs = !p.objective.running.empty() || !p.objective.terminal.empty();
  if (costs)
    text +=
        fmt::format("  psi over a cycle = {}\n", known_digits(r.psi.value, uncertainty(r.psi.value, r.psi.error, p)));
  text += verdict(r);
  text += "\n  multipliers\n";
  for (const auto& m : r.multipliers)
    text += fmt::format("    {}\n", multiplier_text(m, std::max(r.multiplier_error, p.solver.rtol)));
  std::size_t width = 0;
  for (const auto& n : r.names) width = std::max(width, n.size());
  text += "\n  at the section\n";
  for (std::size_t i = 0; i < r.names.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    text += fmt::format("    {:<{}}  {:>18} {}{}\n", r.names[i], width,
                        known_digits(r.x[k], uncertainty(r.x[k], r.x_error[k], p)), r.units[i],
                        r.x_error[k] > 0 ? fmt::format("   estimated error {:.1e}", r.x_error[k]) : "");
  }
  if (r.x_rho.size() > 0) {
    const auto names = p.parameters.names();
    std::size_t w = 9;
    for (const auto& n : names) w = std::max(w, n.size());
    const bool travels = !setup.scene.cycle->travel.empty(), multiplier = r.multiplier_rho.size() > 0;
    const Eigen::VectorXd speed_rho = r.speed_rho();
    const auto row = [&](const std::string& name, const std::string& value, const std::string& psi,
                         const std::string& period, const std::string& speed, const std::string& largest) {
      std::string line = fmt::format("  {:<{}}  {:>18}", name, w, value);
      if (costs) line += fmt::format("  {:>16}", psi);
      line += fmt::format("  {:>16}", period);
      if (travels) line += fmt::format("  {:>16}", speed);
      if (multiplier) line += fmt::format("  {:>16}", largest);
      return line + "\n";
    };
    // No digit beyond the error, nor beyond the tolerance's among what the others make of the same number.
    const auto known = [&](const Eigen::VectorXd& by, const Eigen::VectorXd& error, Eigen::Index k) {
      const double largest = scaled_size(by, p.parameters) / p.parameters.parameters[static_cast<std::size_t>(k)].scale;
      if (error.size() == 0) return fmt::format("{:.7g}", shown(by[k], largest));
      return known_digits(shown(by[k], largest), std::max(error[k], p.solver.rtol * largest));
    };
    text += "\n" + row("parameter", "value", "d(psi)/d(p)", "d(period)/d(p)", "d(speed)/d(p)", "d(multiplier)/d(p)");
    for (std::size_t j = 0; j < names.size(); ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      text += row(names[j], fmt::format("{:.12g}", shown(setup.rho[j])), known(r.psi_rho, r.psi_rho_error, k),
                  known(r.period_rho, r.period_rho_error, k), travels ? known(speed_rho, r.speed_rho_error, k) : "",
                  multiplier ? known_digits(r.multiplier_rho[k], r.multiplier_rho_error[k]) : "");
    }
    if (multiplier)
      text += fmt::format("  d(multiplier)/d(p): of the largest modulus, by {}\n", r.multiplier_method);
    else if (!r.multiplier_method.empty())
      text += fmt::format("  {}\n", r.multiplier_method);
  }
  text += fmt::format("\n  {} event{} a cycle, {} runs, {} steps, {:.3g} s\n", r.events.size(),
                      r.events.size() == 1 ? "" : "s", r.counters.simulations, r.counters.steps, wall);
  return text;
}

int run(const CommonOptions& given, const CycleFlags& flags) {
  CommonOptions common = given;
  flags.add_to(common.overrides);
  if (flags.accuracy.value && !flags.follow.empty())
    throw Error("--accuracy is of one cycle: --continue follows them at rtol.");
  if (flags.accuracy.value && flags.no_estimate)
    throw Error("--accuracy needs the estimates that --no-estimate leaves out.");
  if (flags.report && (!flags.follow.empty() || common.no_files))
    throw Error("--report writes the page of one cycle, so it excludes --continue and --no-files.");
  if (!flags.follow.empty()) return run_branch(common, continue_request(flags.follow), flags.max_points);
  Setup setup(common, Purpose::simulate);
  if (!setup.scene.cycle)
    throw SceneError(
        setup.scene.locate(""),
        "This scene has no [cycle]. Give 'section', an event such as \"contact.left touch\", or 'period_s' "
        "there, or --section or --period.");
  Progress progress(setup.progress_options);
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  CycleOptions options;
  options.estimate = !flags.no_estimate;
  options.derivatives = options.multiplier = !flags.no_derivatives;
  const auto begin = std::chrono::steady_clock::now();
  auto accuracy = flags.accuracy.asked(setup, common);
  if (accuracy && flags.no_estimate) {
    notice_accuracy_left(setup, "--no-estimate leaves out what it needs");
    accuracy.reset();
  }
  std::optional<AccurateCycle> accurate;
  const CycleResult r = setup.located([&] {
    if (!accuracy) return find_cycle(setup.problem, *setup.scene.cycle, setup.rho, options);
    accurate = find_accurate_cycle(setup, common, *accuracy, options);
    return accurate->result;
  });
  const double wall = seconds_since(begin);
  progress.finish();
  Json j = cycle_json(setup, r, wall);
  std::string text = cycle_text(setup, common, r, wall);
  if (accurate) {
    j["accuracy"] = accurate->json;
    text += fmt::format("  accuracy {:.1g} asked for, {} {:.1e} of the {}: {} on {}, rtol {:.1e}\n",
                        accurate->json.at("asked").get<double>(), accurate->met ? "estimated" : "reached",
                        accurate->relative, accurate->worst, setup.problem.formulation, r.integrator,
                        setup.problem.solver.rtol);
  }
  if (flags.report) {
    Setup on_cycle = setup;
    on_cycle.problem.cycle = std::make_shared<const CycleSettings>(*setup.scene.cycle);
    const std::optional<TrajectoryTable> motion =
        setup.located([&] { return motion_for_page(on_cycle, j.at("settings")); });
    add_notices(j);
    text += written_page(setup, "cycle.html", cycle_page(setup, j, text, motion ? &*motion : nullptr));
  }
  report(setup, common, j, text, "cycle.json");
  return accurate && !accurate->met ? kFailed : 0;
}

}  // namespace

const RegisterCommand cycle_command(
    CommandGroup::analyse, "cycle", "A limit cycle or periodic motion, its stability and its derivatives",
    [](Command& c, CommonOptions& common) {
      auto flags = std::make_shared<CycleFlags>();
      common.add_to(c);
      common.add_run_options(c);
      c.remove("--method");
      c.remove("--checkpoint-steps");
      c.option("--section", flags->section, "The event that a cycle begins and ends with, 'contact.left touch'");
      c.option("--period", flags->period, "Its length [s], where forces are periodic in time");
      c.option("--after", flags->after, "Time of a cycle from which on the section is looked for [s]");
      c.option("--count", flags->count, "How many times the section is met in a cycle");
      c.option("--relabel", flags->relabel, "Names that swap roles at the section, LEFT=RIGHT, separated by commas")
          .separated();
      c.option("--travel", flags->travel, "The coordinate that may have moved on");
      c.option("--settle", flags->settle, "Cycles that are gone through before the search begins");
      c.option("--continue", flags->follow,
               "Follow the cycle along a parameter, NAME=FROM..TO: folds, flips and Neimark-Sacker points");
      c.option("--max-points", flags->max_points, "With --continue: cycles at most, in either direction (300)");
      flags->accuracy.add_to(c);
      c.flag("--report", flags->report, "Write cycle.html too, a page with the multipliers and the motion");
      c.flag("--no-estimate", flags->no_estimate, "Without the searches at tighter tolerances that tell errors");
      c.flag("--no-derivatives", flags->no_derivatives, "Without derivatives with respect to the parameters");
      c.runs([&common, flags] { return run(common, *flags); });
    });

}  // namespace costate::app
