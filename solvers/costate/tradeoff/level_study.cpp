#include "costate/tradeoff/level_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/tradeoff/stopwatch.h"

namespace costate {

namespace {

// Two runs looser than that agree by chance: one in twelve said to be known to a third of what it was off by.
constexpr double kFirstAccuracy = 1e-2;
// Of the full model's reference; levels are taken no further either.
constexpr double kReference = 1e-6;
// An integration's error is a small part of a model's below this.
constexpr double kSmall = 0.2;

std::size_t index_of(TradeMeasure m) { return static_cast<std::size_t>(m); }

/// By the full model's scales, relative to its gradient's largest component.
double scaled_error(const std::vector<double>& error, const TradeProbe& full, double unit) {
  return largest_scaled(full.problem().parameters, error) / unit;
}

}  // namespace

LevelStudy::LevelStudy(std::vector<DetailLevel> levels, const LevelStudyOptions& options)
    : levels_(std::move(levels)), options_(options) {
  const SolverOptions& full = levels_.front().problem.solver;
  for (const DetailLevel& l : levels_) {
    const SolverOptions& s = l.problem.solver;
    if (l.problem.ends_when || l.problem.cycle)
      throw CapabilityError(fmt::format(
          "Levels of detail are measured over the same time: '{}' {}. Remove that, or 'costate compare' "
          "the two as far as both go.",
          l.name, l.problem.cycle ? "runs over a cycle ([run] cycle)" : "ends by an event (run.ends_when)"));
    if (s.t_start != full.t_start || s.t_end != full.t_end)
      throw Error(
          fmt::format("Levels of detail are measured over the same time: '{}' runs over {:g} .. {:g} s, '{}' "
                      "over {:g} .. {:g} s. Set run.t_start_s and run.t_end_s.",
                      l.name, s.t_start, s.t_end, levels_.front().name, full.t_start, full.t_end));
    probes_.push_back(std::make_unique<TradeProbe>(l.problem, l.rho, l.outputs, options_.samples));
  }
}

double LevelStudy::spent_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
}

bool LevelStudy::measures(TradeMeasure m) const {
  return std::any_of(runs_.begin(), runs_.end(), [&](const LevelRun& r) { return r.error[index_of(m)].has_value(); });
}

AccurateRun LevelStudy::accurate_run(std::size_t level, double accuracy, bool gradient) const {
  const DetailLevel& l = levels_[level];
  AccuracyRequest request;
  request.accuracy = accuracy;
  request.gradient = gradient;
  if (!gradient) request.outputs = l.outputs;
  std::optional<AccurateRun> r;
  l.located([&] { r = run_to_accuracy(l.problem, l.rho, request); });
  return *r;
}

void LevelStudy::find_reference() {
  tell(fmt::format("{}: the reference", levels_.front().name));
  const AccurateRun& motion = reference_motion_.emplace(accurate_run(0, kReference, false));
  reference_.first = motion.what;
  reference_.rtol_first = motion.problem.solver.rtol;
  reference_.values = probes_[0]->run(motion.what, reference_.rtol_first, 0);
  if (options_.gradient) {
    const AccurateRun& gradient = reference_gradient_.emplace(accurate_run(0, kReference, true));
    reference_.gradient_first = gradient.what.method;
    reference_.values.gradient = gradient.result.gradient;
  }
  reference_.measure(*probes_[0]);
  if (levels_.front().has_cost())
    reference_.floor[index_of(TradeMeasure::psi)] = motion.psi_error / reference_.psi_unit;
  reference_.floor[index_of(TradeMeasure::outputs)] = motion.outputs_error;
  if (options_.gradient)
    reference_.floor[index_of(TradeMeasure::gradient)] =
        scaled_error(reference_gradient_->gradient_error, *probes_[0], reference_.gradient_unit);
}

void LevelStudy::measure() {
  for (std::size_t level = 0; level < levels_.size(); ++level)
    for (const bool gradient : {false, true})
      if (!gradient || options_.gradient) measure_level(level, gradient);
  take_times();
}

void LevelStudy::measure_level(std::size_t level, bool gradient) {
  // The full model's own is the reference.
  const double tightest = level == 0 ? 10 * kReference : kReference;
  for (double accuracy = kFirstAccuracy; accuracy > 0.9 * tightest;) {
    if (out_of_time()) {
      LevelRun& r = runs_.emplace_back();
      r.level = level;
      r.accuracy = accuracy;
      r.what.method = gradient ? "gradient" : "";
      r.why = fmt::format("The budget of {:g} s was spent.", options_.budget_s);
      return;
    }
    tell(fmt::format("{}: {} at accuracy {:.0e}", levels_[level].name, gradient ? "gradient" : "motion", accuracy));
    const LevelRun& r = runs_.emplace_back(run_level(level, accuracy, gradient));
    if (r.status != TradeStatus::ok) return;
    bool separate = level > 0;
    double own = 0;  // what it reached
    for (std::size_t m = 0; m < r.error.size(); ++m) {
      if (!r.error[m]) continue;
      own = std::max(own, *r.integration[m]);
      separate = separate && *r.integration[m] <= kSmall * *r.error[m];
    }
    if (separate) return;
    // What it has reached beyond what was asked for need not be asked for again.
    do accuracy /= 10;
    while (accuracy >= own && accuracy > 1.1 * tightest);
  }
}

LevelRun LevelStudy::run_level(std::size_t level, double accuracy, bool gradient) const {
  LevelRun r;
  r.level = level;
  r.accuracy = accuracy;
  r.what.method = gradient ? "gradient" : "";
  try {
    const AccurateRun accurate = accurate_run(level, accuracy, gradient);
    r.what = accurate.what;
    r.rtol = accurate.problem.solver.rtol;
    TradeValues values;
    if (gradient) {
      const double begin = processor_time_s();
      probes_[level]->repeat(r.what, r.rtol, 0);
      values.time_s = processor_time_s() - begin;
      values.psi = accurate.result.psi;
      values.gradient = accurate.result.gradient;
      values.counters = accurate.result.counters;
    } else {
      values = probes_[level]->run(r.what, r.rtol, 0);
    }
    r.status = TradeStatus::ok;
    r.psi = values.psi;
    r.gradient = values.gradient;
    r.counters = values.counters;
    r.time_s = values.time_s;
    judge(r, values, accurate);
  } catch (const SolverError& e) {
    r.status = TradeStatus::failed;
    r.why = e.what();
  }
  return r;
}

void LevelStudy::judge(LevelRun& r, const TradeValues& values, const AccurateRun& accurate) const {
  const auto put = [&](TradeMeasure m, double error, double integration) {
    r.error[index_of(m)] = error;
    r.integration[index_of(m)] = integration;
  };
  const DetailLevel &full = levels_.front(), &level = levels_[r.level];
  if (full.has_cost() && level.has_cost())
    put(TradeMeasure::psi, std::abs(values.psi - reference_.values.psi) / reference_.psi_unit,
        accurate.psi_error / reference_.psi_unit);
  if (values.motion && !level.outputs.empty()) {
    TradeReference own;
    own.values = values;
    own.measure(*probes_[r.level]);
    double stretch = 0;  // of the level's sizes against the full model's
    for (std::size_t o = 0; o < level.outputs.size(); ++o) {
      const auto at = static_cast<std::size_t>(std::find(full.outputs.begin(), full.outputs.end(), level.outputs[o]) -
                                               full.outputs.begin());
      double apart = 0;
      for (std::size_t s = 0; s < values.motion->outputs.size(); ++s)
        apart = std::max(apart, std::abs(values.motion->outputs[s][o] - reference_.values.motion->outputs[s][at]));
      r.of_output.push_back(apart / reference_.output_unit[at]);
      stretch = std::max(stretch, own.output_unit[o] / reference_.output_unit[at]);
    }
    put(TradeMeasure::outputs, *std::max_element(r.of_output.begin(), r.of_output.end()),
        stretch * accurate.outputs_error);
  }
  if (values.gradient.empty()) return;
  const auto& parameters = probes_[0]->problem().parameters.parameters;
  for (std::size_t j = 0; j < parameters.size(); ++j)
    r.of_parameter.push_back(std::abs(values.gradient[j] - reference_.values.gradient[j]) * parameters[j].scale /
                             reference_.gradient_unit);
  put(TradeMeasure::gradient, *std::max_element(r.of_parameter.begin(), r.of_parameter.end()),
      scaled_error(accurate.gradient_error, *probes_[0], reference_.gradient_unit));
}

void LevelStudy::take_times() {
  if (options_.repeats == 0) return;
  tell("for the clock");
  Race race;
  std::vector<std::size_t> of_job;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (runs_[i].status != TradeStatus::ok) continue;
    race.add([this, i] { probes_[runs_[i].level]->repeat(runs_[i].what, runs_[i].rtol, 0); }, runs_[i].time_s);
    of_job.push_back(i);
  }
  const auto keep = [&] {
    for (std::size_t k = 0; k < of_job.size(); ++k) {
      LevelRun& r = runs_[of_job[k]];
      r.repeats = race.rounds(static_cast<int>(k));
      if (r.repeats > 0) r.time_s = race.timing(static_cast<int>(k)).median_s;
    }
  };
  try {
    race.run(options_.repeats, 2e-3, [&] { return !out_of_time(); });
  } catch (...) {
    keep();
    throw;
  }
  keep();
}

double LevelStudy::dependable(std::size_t run, TradeMeasure m) const {
  const LevelRun& r = runs_[run];
  double most = std::max(*r.integration[index_of(m)], reference_.floor[index_of(m)]);
  for (const LevelRun& other : runs_)
    if (other.level == r.level && other.what.method.empty() == r.what.method.empty() && other.accuracy <= r.accuracy &&
        other.error[index_of(m)])
      most = std::max(most, *other.error[index_of(m)]);
  return most;
}

std::optional<LevelError> LevelStudy::model_error(std::size_t level, TradeMeasure m) const {
  const std::size_t k = index_of(m);
  std::optional<std::size_t> tightest;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const LevelRun& r = runs_[i];
    if (r.level != level || !r.error[k] || r.what.method.empty() != (m != TradeMeasure::gradient)) continue;
    if (!tightest || *r.integration[k] < *runs_[*tightest].integration[k]) tightest = i;
  }
  if (!tightest) return std::nullopt;
  LevelError e{*tightest};
  const double open = *runs_[*tightest].integration[k] + reference_.floor[k];
  e.error = *runs_[*tightest].error[k];
  e.resolved = e.error > open;
  if (!e.resolved) e.error = open + e.error;
  return e;
}

std::vector<LevelChoice> LevelStudy::choices(TradeMeasure m) const {
  std::vector<LevelChoice> all;
  for (int digit = 1; std::pow(10, -digit) >= reference_.floor[index_of(m)] && digit < 16; ++digit) {
    const double target = std::pow(10, -digit);
    std::optional<std::size_t> best, full;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      const LevelRun& r = runs_[i];
      if (!r.error[index_of(m)] || r.what.method.empty() != (m != TradeMeasure::gradient)) continue;
      if (dependable(i, m) > target) continue;
      if (!best || r.time_s < runs_[*best].time_s) best = i;
      if (r.level == 0 && (!full || r.time_s < runs_[*full].time_s)) full = i;
    }
    if (best) all.push_back({target, *best, full});
  }
  return all;
}

}  // namespace costate
