#include "cycle_branch.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>

#include "accuracy.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/cycle/branch.h"
#include "costate/record/atomic_file.h"
#include "costate/record/interrupt.h"
#include "costate/record/svg_plot.h"
#include "digits.h"
#include "trajectory.h"

namespace costate::app {

namespace {

std::string multiplier_text(const std::complex<double>& m) {
  return m.imag() == 0 ? fmt::format("{:.7g}", m.real())
                       : fmt::format("{:.7g} {} {:.7g} i", m.real(), m.imag() < 0 ? '-' : '+', std::abs(m.imag()));
}

Json point_json(const BranchPoint& p, const Branch& b, bool travels) {
  Json j;
  j["parameter"] = p.parameter;
  j["period_s"] = p.period;
  if (travels) j["speed_m_per_s"] = p.speed();
  j["psi"] = p.psi;
  j["fixed_point"] = named(b.names, {p.x.data(), p.x.data() + p.x.size()});
  j["multipliers"] = Json::array();
  for (const auto& m : p.multipliers) j["multipliers"].push_back({m.real(), m.imag()});
  j["stable"] = p.stable() ? Json(*p.stable()) : Json();
  return j;
}

Json branch_json(const Setup& setup, const ContinueRequest& request, const Branch& b, double wall) {
  const bool travels = !setup.scene.cycle->travel.empty();
  Json j;
  j["parameter"] = request.parameter;
  j["from"] = request.from;
  j["to"] = request.to;
  j["branch"] = Json::array();
  for (const BranchPoint& p : b.points) j["branch"].push_back(point_json(p, b, travels));
  j["bifurcations"] = Json::array();
  for (const Bifurcation& f : b.bifurcations) {
    Json of = point_json(f.at, b, travels);
    of["kind"] = name_of(f.kind);
    of["parameter_error"] = f.parameter_error;
    of["multiplier"] = {f.multiplier.real(), f.multiplier.imag()};
    j["bifurcations"].push_back(of);
  }
  j["ended"] = {b.ended_first, b.ended_last};
  j["formulation"] = setup.problem.formulation;
  j["integrator"] = integrator_of(setup.problem);
  j["rtol"] = setup.problem.solver.rtol;
  j["counters"] = counters_json(b.counters);
  j["wall_s"] = wall;
  j["status"] = b.interrupted == 0 ? "ok" : "interrupted";
  j["warnings"] = warnings_of(setup);
  j["settings"] = settings_json(setup);
  return j;
}

/// The period, or the speed of what travels, over the parameter: stable cycles drawn through, others dashed.
std::string branch_svg(const Setup& setup, const ContinueRequest& request, const Branch& b) {
  const bool travels = !setup.scene.cycle->travel.empty();
  const auto value = [&](const BranchPoint& p) { return travels ? p.speed() : p.period; };
  const bool all_decided =
      std::all_of(b.points.begin(), b.points.end(), [](const BranchPoint& p) { return p.stable().has_value(); });
  SvgCurve stable{"stable", {}, {}, SvgCurve::Stroke::dark},
      other{all_decided ? "not stable" : "not stable or not decided", {}, {}, SvgCurve::Stroke::dashed};
  const auto is_stable = [&](std::size_t i) { return b.points[i].stable().value_or(false); };
  for (std::size_t i = 0; i < b.points.size(); ++i) {
    SvgCurve& mine = is_stable(i) ? stable : other;
    SvgCurve& theirs = is_stable(i) ? other : stable;
    mine.x.push_back(b.points[i].parameter);
    mine.y.push_back(value(b.points[i]));
    // The line goes on to where the other begins.
    const bool last = i + 1 < b.points.size() && is_stable(i + 1) != is_stable(i);
    theirs.x.push_back(b.points[i].parameter);
    theirs.y.push_back(last ? value(b.points[i]) : std::numeric_limits<double>::quiet_NaN());
  }
  SvgPlot plot;
  plot.x_label = request.parameter;
  plot.y_label = travels ? "speed [m/s]" : "period [s]";
  plot.curves = {other, stable};
  for (const Bifurcation& f : b.bifurcations) {
    SvgCurve at{fmt::format("{} at {:.5g}", name_of(f.kind), f.at.parameter), {f.at.parameter}, {value(f.at)}};
    at.markers = true;
    plot.curves.push_back(at);
  }
  return svg_of(plot) + "\n";
}

std::string branch_text(const Setup& setup, const CommonOptions& common, const ContinueRequest& request,
                        const Branch& b, double wall) {
  const bool travels = !setup.scene.cycle->travel.empty();
  std::string text = fmt::format("{}\n", setup.scene.title.empty() ? common.scene : setup.scene.title);
  text += fmt::format("  {} on {}, rtol {:g}: {} cycles along {}\n", setup.problem.formulation,
                      integrator_of(setup.problem), setup.problem.solver.rtol, b.points.size(), request.parameter);
  text += fmt::format("\n  {:>18}  {:>14}  {}largest multiplier\n", request.parameter, "period [s]",
                      travels ? fmt::format("{:>14}  ", "speed [m/s]") : "");
  const std::size_t every = std::max<std::size_t>(1, b.points.size() / 20);
  for (std::size_t i = 0; i < b.points.size(); ++i) {
    if (i % every != 0 && i + 1 != b.points.size()) continue;
    const BranchPoint& p = b.points[i];
    text += fmt::format("  {:>18.9g}  {:>14.8g}  {}{}{}\n", p.parameter, p.period,
                        travels ? fmt::format("{:>14.8g}  ", p.speed()) : "",
                        p.multipliers.empty() ? "none" : multiplier_text(p.multipliers.front()),
                        !p.stable()   ? "   not decided"
                        : *p.stable() ? ""
                                      : "   not stable");
  }
  text += "\n";
  for (const Bifurcation& f : b.bifurcations)
    text += fmt::format("  {} at {} = {} (within {:.1e}): multiplier {}, period {:.8g} s\n", name_of(f.kind),
                        request.parameter, known_digits(f.at.parameter, std::max(f.parameter_error, 1e-12)),
                        f.parameter_error, multiplier_text(f.multiplier), f.at.period);
  if (b.bifurcations.empty()) text += "  no multiplier crosses the unit circle\n";
  text += fmt::format("  ends: {}; {}\n", b.ended_first, b.ended_last);
  text += fmt::format("  {} runs, {} steps, {:.3g} s\n", b.counters.simulations, b.counters.steps, wall);
  return text;
}

}  // namespace

ContinueRequest continue_request(const std::string& text) {
  const auto fail = [&]() -> ContinueRequest {
    throw Error(
        fmt::format("--continue needs NAME=FROM..TO, a parameter and two numbers, found '{}'. Example: --continue "
                    "slope=0.001..0.02.",
                    text));
  };
  const std::size_t equals = text.find('='), dots = text.find("..", equals == std::string::npos ? 0 : equals);
  if (equals == std::string::npos || equals == 0 || dots == std::string::npos) return fail();
  ContinueRequest r;
  r.parameter = text.substr(0, equals);
  const auto number = [&](std::size_t from, std::size_t to, double& x) {
    const char *first = text.data() + from, *last = text.data() + to;
    const auto [end, error] = std::from_chars(first, last, x);
    return error == std::errc() && end == last && std::isfinite(x);
  };
  if (!number(equals + 1, dots, r.from) || !number(dots + 2, text.size(), r.to) || r.from == r.to) return fail();
  return r;
}

int run_branch(const CommonOptions& given, const ContinueRequest& request, int max_points) {
  CommonOptions common = given;
  common.parameters = {request.parameter};
  Setup setup(common, Purpose::simulate);
  if (!setup.scene.cycle) throw SceneError(setup.scene.locate(""), "This scene has no [cycle].");
  notice_accuracy_left(setup, "a branch of cycles is followed at one tolerance");
  if (max_points < 1) throw Error(fmt::format("--max-points must be at least 1, found {}.", max_points));
  const double low = std::min(request.from, request.to), high = std::max(request.from, request.to);
  const double here = setup.rho[0];
  setup.rho[0] = std::clamp(here, low, high);
  if (here != setup.rho[0])
    notice(fmt::format("The scene's {} is {:.6g}, outside the range: the branch is begun at {:.6g}.", request.parameter,
                       here, setup.rho[0]));
  // Which numbers a scene may have are ranges: those of both ends, all between.
  for (const double end : {low, high}) try {
      const Unsaid reading;
      setup.scene.with_parameters(setup.problem.parameters, {end});
    } catch (const Error& e) {
      throw Error(fmt::format("--continue {}={:g}..{:g}: {}", request.parameter, request.from, request.to, e.what()));
    }
  Progress progress(setup.progress_options);
  progress.start(setup.problem.solver.t_start);
  setup.problem.monitor = monitor(progress, setup.problem.solver.t_end);
  BranchOptions options;
  options.from = low;
  options.to = high;
  options.max_points = max_points;
  const auto begin = std::chrono::steady_clock::now();
  const Branch b = setup.located([&] { return follow_cycles(setup.problem, *setup.scene.cycle, setup.rho, options); });
  const double wall = seconds_since(begin);
  progress.finish();
  Json j = branch_json(setup, request, b, wall);
  std::string text = branch_text(setup, common, request, b, wall);
  if (setup.write_file("branch.svg",
                       [&](const auto& path) { write_file_atomically(path, branch_svg(setup, request, b)); })) {
    const std::string file = (setup.directory / "branch.svg").string();
    j["files"] = {file};
    text += fmt::format("  drawing: {}\n", file);
  }
  const int status = b.interrupted == 0 ? 0 : 128 + b.interrupted;
  if (status != 0) {
    const std::string what = fmt::format("{} {} cycles of the branch had been found; they stand.",
                                         Interrupted(b.interrupted).what(), b.points.size());
    j["error"] = what;
    print_message(what);
  }
  report(setup, common, j, text, "branch.json");
  return status;
}

}  // namespace costate::app
