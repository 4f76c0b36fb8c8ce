#include "trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/stop.h"
#include "costate/integrator/run_end.h"
#include "costate/mechanism/multiplier_unit.h"
#include "costate/objective/all_outputs.h"
#include "costate/record/csv_file.h"
#include "costate/record/hdf5_file.h"
#include "costate/record/interrupt.h"
#include "costate/sensitivity/cycle_gradient.h"
#include "explain/left_out.h"
#include "named_outputs.h"

namespace costate::app {

namespace {
constexpr std::size_t kSamplesAtOnce = 16;
}

TrajectoryRecorder::TrajectoryRecorder(const Setup& setup, const std::vector<double>& rho, std::optional<double> step,
                                       bool only_end, const std::vector<std::string>& chosen)
    : setup_(setup), rho_(rho), assembly_(setup.problem.mechanism, setup.problem.parameters) {
  assembly_.set_parameters(rho_.data());
  const double t0 = setup.problem.solver.t_start;
  double t1 = setup.problem.solver.t_end;
  double h = step.value_or(setup.scene.run.output_step_s.value_or(0));
  if (step && !(*step > 0 && std::isfinite(*step)))
    throw Error(fmt::format("--output-step must be a positive number, found {}.", *step));
  if (!(h > 0)) {
    if (!only_end) t1 = until_its_end(setup.problem, rho).solver.t_end;
    h = (t1 - t0) / 500;
  }
  const double count = std::floor((t1 - t0) / h + 1e-9);
  if (!(count < 2e7))
    throw Error(fmt::format("An output step of {:g} s gives {:.3g} samples; choose a larger one.", h, count));
  for (long i = 0; i <= static_cast<long>(count); ++i) times_.push_back(t0 + static_cast<double>(i) * h);
  if (times_.back() > t1 || t1 - times_.back() < 1e-9 * h) times_.back() = t1;
  if (times_.back() < t1) times_.push_back(t1);
  // A run that ends by itself hands out its end besides.
  if (setup.problem.ends_when && times_.size() > 1) times_.pop_back();
  // An integrator's first step depends on how far it is first asked to go: the first sample stays, so that the run
  // does.
  if (only_end && times_.size() > 2) {
    times_.resize(2);
    times_.erase(times_.begin());
    if (!setup.problem.ends_when) times_.push_back(t1);
  }
  prepare(*setup.problem.mechanism);
  if (!chosen.empty()) choose(*setup.problem.mechanism, chosen);
  for (Column& c : table_.columns) c.values.reserve(times_.size());
  open_.emplace(setup.problem, rho_, outputs_, whole_);
}

void TrajectoryRecorder::choose(const Mechanism& m, const std::vector<std::string>& chosen) {
  std::vector<std::string> names;
  std::vector<Column> columns;
  for (const std::string& name : chosen) {
    const Column* column = column_of_output(table_, name);  // none of time, which is with every sample
    if (!column || std::find(names.begin(), names.end(), name) != names.end()) continue;
    names.push_back(name);
    columns.push_back(*column);
  }
  outputs_ = make_outputs(m, names);
  table_.columns = std::move(columns);
  whole_ = false;
}

void TrajectoryRecorder::prepare(const Mechanism& m) {
  const auto add = [&](const std::string& group, const std::string& name, const std::string& unit) {
    table_.columns.push_back({name, unit, group, {}});
  };
  for (const auto& c : m.coordinates()) add("coordinates", c.name, c.unit);
  for (const auto& c : m.coordinates()) add("velocities", c.name, c.unit + "/s");
  for (const auto& c : m.coordinates()) add("accelerations", c.name, c.unit + "/s^2");
  const auto add_all = [&](const char* group, const std::vector<std::string>& names,
                           const std::vector<std::string>& units) {
    for (std::size_t i = 0; i < names.size(); ++i) add(group, names[i], units[i]);
  };
  add_all("multipliers", m.row_names(), multiplier_units(m));
  add_all("states", m.state_names(), state_units(m));
  // Coordinates, multipliers, states and time have groups of their own.
  std::set<std::string> elsewhere = {"time"};
  for (const auto& c : m.coordinates())
    for (const char* suffix : {"", "_dot", "_ddot"}) elsewhere.insert(c.name + suffix);
  for (auto& o : make_all_outputs(m)) {
    const std::string& name = o->name();
    if (elsewhere.contains(name) || name.starts_with("lambda.") || name.starts_with("z.")) continue;
    add("outputs", name, o->unit());
    outputs_.push_back(std::move(o));
  }
}

SampleSink TrajectoryRecorder::sink() {
  return [this](const MechanismState& s, System&) {
    table_.time_s.push_back(s.t);
    open_->look(s);
    for (const double* x : {s.q, s.v, s.a}) collected_.insert(collected_.end(), x, x + assembly_.n());
    collected_.insert(collected_.end(), s.lambda, s.lambda + assembly_.m());
    collected_.insert(collected_.end(), s.z, s.z + assembly_.nz());
    if (table_.time_s.size() % kSamplesAtOnce == 0) store_collected();
  };
}

void TrajectoryRecorder::store_collected() {
  const std::size_t n = assembly_.n(), m = assembly_.m(), size = 3 * n + m + assembly_.nz();
  const std::size_t count = collected_.size() / size, first = table_.time_s.size() - count, direct = whole_ ? size : 0;
  for (std::size_t c = 0; c < direct; ++c)
    for (std::size_t i = 0; i < count; ++i) table_.columns[c].values.push_back(collected_[i * size + c]);
  std::vector<MechanismState> states;
  for (std::size_t i = 0; i < count; ++i) {
    const double* x = collected_.data() + i * size;
    states.push_back({table_.time_s[first + i], x, x + n, x + 2 * n, x + 3 * n, x + 3 * n + m});
  }
  for (std::size_t o = 0; o < outputs_.size(); ++o)
    for (const MechanismState& s : states)
      table_.columns[direct + o].values.push_back(outputs_[o]->value(s, assembly_));
  collected_.clear();
}

const TrajectoryTable& TrajectoryRecorder::table() {
  store_collected();
  return table_;
}

Json TrajectoryRecorder::terminal() {
  KeyedObject j;
  for (const Column& c : table().columns)
    if (!c.values.empty()) j.set(output_of_column(c), c.values.back());
  return j.take();
}

Json TrajectoryRecorder::units() const {
  KeyedObject j;
  for (const Column& c : table_.columns) j.set(output_of_column(c), c.unit);
  return j.take();
}

std::vector<std::string> not_finite_remarks(const TrajectoryTable& table) {
  std::vector<std::string> remarks;
  for (const Column& c : table.columns) {
    const auto wrong = std::find_if(c.values.begin(), c.values.end(), [](double x) { return !std::isfinite(x); });
    if (wrong == c.values.end()) continue;
    const auto count = std::count_if(wrong, c.values.end(), [](double x) { return !std::isfinite(x); });
    remarks.push_back(fmt::format(
        "'{}' is not a number at {} of {} samples, at t = {:.6g} s first: a formula outside its domain "
        "(sqrt(-1), log(0), 1/0), or numbers that overflow.",
        output_of_column(c), count, c.values.size(), table.time_s[static_cast<std::size_t>(wrong - c.values.begin())]));
  }
  return remarks;
}

TrajectoryTable TrajectoryRecorder::finish(const Json& settings, const Simulation& run) {
  store_collected();
  if (setup_.scene.run.events)
    for (const RunEvent& e : run.events) table_.events.push_back({e.t, e.name, e.mode, e.jump});
  table_.scene_text = setup_.scene.dump();
  table_.settings = nlohmann::json(settings);
  return std::move(table_);
}

std::vector<std::string> write_trajectory(const Setup& setup, const TrajectoryTable& table, const std::string& name,
                                          bool csv) {
  std::vector<std::string> paths;
  std::error_code ignored;
  const auto written = [&](const char* extension, const auto& write) {
    if (setup.write_file(name + extension, [&](const auto& path) { write(path, table); }))
      paths.push_back((setup.directory / (name + extension)).string());
  };
  written(".h5", write_hdf5);
  if (csv)
    written(".csv", write_csv);
  else if (setup.files)  // another motion's
    std::filesystem::remove(setup.directory / (name + ".csv"), ignored);
  return paths;
}

TrajectoryTable shown_trajectory(const Setup& given, const std::vector<double>& at, const Json& settings) {
  Setup setup = given;
  std::vector<double> rho;
  std::tie(setup.problem, rho) = shown_motion(whole_problem(given), at);
  TrajectoryRecorder recorder(setup, rho, std::nullopt);
  const Simulation run = simulate(setup.problem, rho, recorder.times(), recorder.sink());
  return recorder.finish(settings, run);
}

Monitor monitor(Progress& progress, double t_end) {
  return [&progress, t_end](double t, long steps, bool) {
    throw_if_interrupted();
    check_stop();  // of a program that holds the tool
    progress.update(t, t_end, steps);
  };
}

}  // namespace costate::app
