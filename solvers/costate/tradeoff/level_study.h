// Levels of detail of one thing: what each makes of psi, of outputs along the motion and of the gradient, against the
// full model, and in what time. Each level, the full one among them, runs at accuracies of rising power of ten, by the
// setting that is the cheapest for it (accurate_run.h), until its integration's error is a small part of what sets it
// apart from the full model: what is left then is the model's own.
#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/tradeoff/accurate_run.h"
#include "costate/tradeoff/trade_reference.h"

namespace costate {

struct DetailLevel {
  std::string name;
  Problem problem;  // of a gradient with the parameters that all levels have, in the same order
  std::vector<double> rho;
  std::vector<std::string> outputs;  // of the full model's; another level may lack some
  /// Runs f; an error of the mechanism is told at its place in the level's own scene.
  std::function<void(const std::function<void()>&)> located = [](const std::function<void()>& f) { f(); };

  bool has_cost() const { return !problem.objective.running.empty() || !problem.objective.terminal.empty(); }
};

struct LevelStudyOptions {
  bool gradient = false;
  double budget_s = 0;  // wall time; 0: unlimited
  int repeats = 5;      // for the clock
  int samples = 60;     // of the motion
};

/// One run: a simulation, of psi and outputs, or a gradient.
struct LevelRun {
  std::size_t level = 0;  // 0: the full model
  double accuracy = 0;    // asked for
  TradeStatus status = TradeStatus::left_out;
  std::string why;   // it did not end
  Combination what;  // of a gradient with its method
  double rtol = 0;
  double psi = 0;
  std::vector<double> gradient;
  /// By measure, relative to the full model's sizes: the distance to its reference, and what the run's own integration
  /// is estimated to have of it.
  std::array<std::optional<double>, 3> error, integration;
  std::vector<double> of_output, of_parameter;  // the distance by the level's outputs, by parameter
  Counters counters;
  double time_s = 0;  // processor time: the median of `repeats` interleaved runs, or of one (0)
  int repeats = 0;
};

/// What sets a level apart from the full model: its run of the smallest error of integration.
struct LevelError {
  std::size_t run = 0;
  double error = 0;       // or what it is below, where it is not `resolved`
  bool resolved = false;  // larger than what both integrations may have of it
};

struct LevelChoice {
  double target = 0;                // a power of ten
  std::size_t run = 0;              // the fastest that reaches it
  std::optional<std::size_t> full;  // the full model's fastest
};

class LevelStudy {
 public:
  /// The first is the full model. All run over the same time, and none ends by an event; throws where that is not so.
  LevelStudy(std::vector<DetailLevel> levels, const LevelStudyOptions& options);

  std::function<void(const std::string&)> tell = [](const std::string&) {};

  /// The full model at the tightest accuracy; throws what its runs throw.
  void find_reference();
  /// All levels, then the clock. What a monitor throws passes through; what was measured until then stays.
  void measure();

  const std::vector<DetailLevel>& levels() const { return levels_; }
  const std::vector<LevelRun>& runs() const { return runs_; }
  /// The full model's values, and what its own integration leaves open, by measure.
  const TradeReference& reference() const { return reference_; }
  const AccurateRun& reference_run(bool gradient) const { return gradient ? *reference_gradient_ : *reference_motion_; }
  const TradeProbe& probe(std::size_t level) const { return *probes_[level]; }
  const LevelStudyOptions& options() const { return options_; }
  bool measures(TradeMeasure m) const;
  double spent_s() const;
  bool out_of_time() const { return options_.budget_s > 0 && spent_s() >= options_.budget_s; }

  std::optional<LevelError> model_error(std::size_t level, TradeMeasure m) const;
  /// From 1e-1 down to what the reference leaves open; an entry where a run reaches it.
  std::vector<LevelChoice> choices(TradeMeasure m) const;

 private:
  void measure_level(std::size_t level, bool gradient);
  LevelRun run_level(std::size_t level, double accuracy, bool gradient) const;
  void judge(LevelRun& run, const TradeValues& values, const AccurateRun& accurate) const;
  AccurateRun accurate_run(std::size_t level, double accuracy, bool gradient) const;
  void take_times();
  /// What one can depend on: no less than the distance, nor than the integration's own error.
  double dependable(std::size_t run, TradeMeasure m) const;

  std::vector<DetailLevel> levels_;
  std::vector<std::unique_ptr<TradeProbe>> probes_;
  LevelStudyOptions options_;
  std::vector<LevelRun> runs_;
  TradeReference reference_;
  std::optional<AccurateRun> reference_motion_, reference_gradient_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

}  // namespace costate
