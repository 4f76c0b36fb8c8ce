// The trade of accuracy for cost on one problem: every combination of formulation, integrator and (for gradients)
// method at every tolerance or step, against a reference that it computes itself; within a budget of time.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "costate/tradeoff/trade_reference.h"
#include "costate/tradeoff/trade_table.h"

namespace costate {

struct TradeOptions {
  std::vector<std::string> outputs;                             // along the motion
  std::vector<std::string> formulations, integrators, methods;  // empty: all
  std::vector<double> tolerances = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11};
  std::vector<double> steps;  // of fixed steps [s]; empty: the one chosen for rtol 1e-3, and its halves
  bool gradient = false;
  double budget_s = 0;   // wall time; 0: unlimited
  int repeats = 5;       // for the clock
  int samples = 60;      // of the motion
  double patience = 30;  // a run is cut at so many times the processor time of the fastest at the same setting
};

struct TradeRefusal {
  Combination what;
  std::string why;
};

class TradeStudy {
 public:
  TradeStudy(const Problem& problem, const std::vector<double>& rho, TradeOptions options);
  TradeStudy(const TradeStudy&) = delete;
  TradeStudy& operator=(const TradeStudy&) = delete;

  /// What is going on, in a line now and then.
  std::function<void(const std::string&)> tell = [](const std::string&) {};

  /// Finds the reference; throws where there is none, and what the monitor throws.
  void find_reference();
  /// Runs the rows, beside each other where there are jobs() (record/jobs.h), then the clock, in one thread with
  /// nothing beside it. What the monitor throws passes through; what was measured until then stays.
  void measure();

  const TradeTable& table() const { return table_; }
  const std::vector<TradeRefusal>& refusals() const { return refusals_; }
  const TradeReference& reference() const { return reference_; }
  const TradeProbe& probe() const { return probe_; }
  double spent_s() const;
  /// How many runs there were beside each row's first one, whose times stand where there was no turn at the clock.
  int runs_beside() const { return beside_; }
  bool out_of_time() const { return options_.budget_s > 0 && spent_s() >= options_.budget_s; }

 private:
  void choose_combinations();
  void choose_rows();
  std::vector<double> fixed_step_lengths(const RunBudget& budget) const;
  void run_rows();
  bool fill(TradeRow& row, double limit_s) const;
  void refuse(std::size_t combination, const std::string& why);
  void take_times();

  TradeOptions options_;
  TradeProbe probe_;
  std::string redundant_;
  TradeReference reference_;
  TradeTable table_;
  std::vector<TradeRefusal> refusals_;
  int beside_ = 0;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

}  // namespace costate
