// costate sweep: one coordinate is led through a range; outputs against it as CSV and JSON.
#include "costate/analysis/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis.h"
#include "costate/base/notice.h"
#include "costate/mechanism/multiplier_unit.h"
#include "costate/record/atomic_file.h"
#include "costate/record/print.h"
#include "digits.h"
#include "page/command_pages.h"

namespace costate::app {

namespace {

struct SweepOptions {
  AnalysisOptions analysis;
  std::string coordinate;
  double from = 0, to = 0;
  int count = 21;
  std::vector<std::string> outputs;
};

/// A coordinate that follows a law of time alone cannot be led anywhere else.
void require_undriven(const Mechanism& m, int coordinate) {
  for (const auto& c : m.constraints())
    if (c->rheonomic() && c->coordinates() == std::vector<int>{coordinate})
      throw ModelError(c->path(), fmt::format("'{0}' follows this law of time, so that a sweep cannot lead it. Sweep "
                                              "another coordinate, or take [{1}] out of the scene.",
                                              m.coordinates()[static_cast<std::size_t>(coordinate)].name, c->path()));
}

/// Rows of numbers, separated by commas, as they are; printed among numbers as large as `sizes`, one a column, if there
/// are some.
std::string csv_rows(const std::vector<std::vector<double>>& rows, const std::vector<double>& sizes) {
  std::string text;
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i)
      text += fmt::format("{}{}", shown(row[i], sizes.empty() ? 0 : sizes[i]), i + 1 < row.size() ? "," : "\n");
  return text;
}

/// A sweep goes on along balances that no mechanism would stay at.
void tell_unstable(const Sweep& sweep, const std::string& name, const std::string& unit) {
  const auto stays = [](const SweepPoint& p) { return is_stable(p.at); };
  const auto left =
      sweep.points.size() - static_cast<std::size_t>(std::count_if(sweep.points.begin(), sweep.points.end(), stays));
  if (left == 0) return;
  const auto first = std::find_if_not(sweep.points.begin(), sweep.points.end(), stays);
  notice(
      fmt::format("At {} of {} points, first at {} = {:.6g} {}, the balance is not stable (a stiffness is {:.4g} 1/s^2 "
                  "per mass there): the mechanism would leave it, for where this sweep does not go.",
                  left, sweep.points.size(), name, first->value, unit, first->at.lowest_stiffness));
}

int run(const CommonOptions& common, SweepOptions& options) {
  if (options.count < 2 || options.count > 100000)
    throw Error(fmt::format("--count must be 2 to 100000, found {}.", options.count));
  for (const auto& [option, x] : {std::pair{"--from", options.from}, std::pair{"--to", options.to}})
    if (!std::isfinite(x)) throw Error(fmt::format("{} must be a finite number, found {}.", option, x));
  if (options.from == options.to)
    throw Error(fmt::format("--from and --to must differ, found {} twice.", options.from));
  const Scene scene = load_for_analysis(common, options.analysis, options.analysis.at_equilibrium);
  const auto m = scene.mechanism();
  const int coordinate = m->coordinate(options.coordinate);
  const std::string name = m->coordinates()[static_cast<std::size_t>(coordinate)].name;
  const std::string unit = m->coordinates()[static_cast<std::size_t>(coordinate)].unit;
  std::vector<std::string> names = options.outputs.empty() ? scene.run.outputs : options.outputs;
  if (names.empty()) names = m->coordinate_names();
  const auto outputs = outputs_named(*m, names);
  Assembly assembly(m, ParameterSelection{});
  const double t = scene.run.t_start_s;
  const Sweep sweep = located_in(scene, [&] {
    require_undriven(assembly.mechanism(), coordinate);
    try {
      return sweep_position(assembly, t, held_by_start(assembly), coordinate, options.from, options.to, options.count);
    } catch (const ModelError& e) {
      const bool many = e.bare_message().rfind("Too many given", 0) == 0;
      throw ModelError(e.subject(), e.bare_message() + (many ? " With --hold you say which others are held." : ""));
    }
  });

  Json j;
  j["status"] = sweep.stopped.empty() ? "ok" : "stopped";
  if (!sweep.stopped.empty()) j["error"] = sweep.stopped;
  j["scene"] = scene.file_name();
  j["title"] = scene.title;
  j["coordinate"] = name;
  j["unit"] = unit;
  j["reached"] = sweep.reached;
  KeyedObject columns, units;
  std::vector<Json> found(outputs.size(), Json::array());
  const std::string force_unit = unit == "m" ? "N" : unit == "rad" ? "N m" : "";
  std::string header = fmt::format("{} [{}]", name, unit);
  for (const auto& o : outputs) {
    units.set(o->name(), o->unit());
    header += fmt::format(",{} [{}]", o->name(), o->unit());
  }
  header += ",held_force\n";
  std::vector<std::vector<double>> rows;
  Listing sizes;  // of the table's numbers, and of the constraints' forces, which the held one may be made of
  const auto row_units = multiplier_units(*m);
  Json values = Json::array(), forces = Json::array(), stable = Json::array();
  for (const auto& p : sweep.points) {
    values.push_back(p.value);
    rows.push_back({p.value});
    sizes.add("", p.value, unit);
    for (std::size_t i = 0; i < row_units.size(); ++i)
      sizes.add("", p.at.lambda[static_cast<Eigen::Index>(i)], row_units[i]);
    for (std::size_t k = 0; k < outputs.size(); ++k) {
      const double x = value_at_rest(*outputs[k], assembly, t, p.at);
      found[k].push_back(x);
      rows.back().push_back(x);
      sizes.add("", x, outputs[k]->unit());
    }
    const double force = -p.at.held[p.at.held.size() - 1];  // what pushes the coordinate there
    forces.push_back(force);
    stable.push_back(is_stable(p.at));
    rows.back().push_back(force);
    sizes.add("", force, force_unit);
  }
  j["values"] = values;
  for (std::size_t k = 0; k < outputs.size(); ++k) columns.set(outputs[k]->name(), std::move(found[k]));
  j["outputs"] = columns.take();
  j["units"] = units.take();
  j["held_force"] = forces;
  j["stable"] = stable;
  tell_unstable(sweep, name, unit);
  add_notices(j);
  std::string text =
      fmt::format("{}\n  {} points of {} from {:g} to {:g} {}\n", scene.title.empty() ? common.scene : scene.title,
                  sweep.points.size(), name, options.from, options.to, unit);
  if (!common.no_files) {
    const auto directory = common.output.empty()
                               ? std::filesystem::path("results") / std::filesystem::path(common.scene).stem()
                               : common.output;
    require_writable(directory);
    write_file_atomically(directory / "sweep.csv", header + csv_rows(rows, {}));
    write_file_atomically(directory / "sweep.json", json_text(j) + "\n");
    write_file_atomically(directory / "sweep.html", sweep_page(scene, j));
    j["files"] = Json::array();
    for (const char* file : {"sweep.csv", "sweep.json", "sweep.html"}) {
      j["files"].push_back((directory / file).string());
      text += fmt::format("  {}\n", (directory / file).string());
    }
  } else {
    auto size = sizes.sizes();
    std::vector<double> of = {size[unit]};
    for (const auto& o : outputs) of.push_back(size[o->unit()]);
    of.push_back(force_unit.empty() ? 0 : size[force_unit]);
    text += header + csv_rows(rows, of);
  }
  if (common.hand_over) {
    common.hand_over(j);
  } else {
    print_warnings(j.at("warnings").get<std::vector<std::string>>());
    if (common.json)
      fmt::print("{}\n", json_text(j));
    else if (!common.quiet)
      print_result(text);
  }
  if (sweep.stopped.empty()) return 0;
  print_message(sweep.stopped);
  return kFailed;
}

}  // namespace

const RegisterCommand sweep_command(
    CommandGroup::analyse, "sweep", "Lead one coordinate through a range and tabulate outputs",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<SweepOptions>();
      common.add_to(c);
      c.option("--coordinate", options->coordinate, "The coordinate that is led").required();
      c.option("--from", options->from, "First value [m, rad]").required();
      c.option("--to", options->to, "Last value").required();
      c.option("--count", options->count, "Number of points (default: 21)");
      c.option("--outputs", options->outputs,
               "Outputs, separated by commas (default: those of [run], else all positions)")
          .separated();
      options->analysis.add_hold(c,
                                 "Other positions held, separated by commas, or 'none' (default: what [start] gives)");
      c.flag("--equilibrium", options->analysis.at_equilibrium,
             "Find force states by balance, also where the scene does not start at equilibrium");
      c.option("--output", common.output,
               "Directory for sweep.csv, sweep.json and sweep.html (default: results/SCENE)");
      c.existing("--no-files").text("Write no files; the table goes to standard output");
      c.flag("--json", common.json, "Print one JSON object and nothing else");
      c.runs([&common, options] { return run(common, *options); });
    });

}  // namespace costate::app
