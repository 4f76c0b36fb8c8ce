// One run looked at closely: psi, chosen outputs and energies at sample times, how well the constraints hold.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "costate/integrator/run_budget.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/tradeoff/trade_table.h"

namespace costate {

struct TradeMotion {
  std::vector<std::vector<double>> outputs;       // by sample, then by output
  std::vector<double> amounts;                    // of each output: what the terms amount to that make it
  std::vector<double> energy, kinetic;            // by sample [J]; empty where the mechanism has no energies
  double position_drift = 0, velocity_drift = 0;  // largest |Phi|, |Phid| of a row [SI]
  std::vector<double> lowest, highest;            // of each coordinate
  double cost_amount = 0;  // the cost with each of its terms by its amount, by the rectangle rule
};

struct TradeValues {
  double psi = 0;
  std::vector<double> gradient;  // empty for a simulation
  std::optional<TradeMotion> motion;
  std::vector<double> event_times;  // s, in order, where they are asked for
  Counters counters;
  double time_s = 0;  // processor time
};

/// Of runs beside each other, too.
class TradeProbe {
 public:
  /// Samples at `samples` times that are not round, where laws have their corners, up to the end of the run at rho.
  /// `besides`: outputs behind those, of which errors are told, and nothing is asked.
  TradeProbe(const Problem& problem, const std::vector<double>& rho, const std::vector<std::string>& outputs,
             int samples, const std::vector<std::string>& besides = {});

  /// The problem by this combination; its fixed step or its tolerance, with the absolute one in proportion.
  Problem prepared(const Combination& c, double rtol, double step_s) const;
  /// What a run is to hand out besides.
  struct Recording {
    std::vector<double> times;
    SampleSink sink;
  };
  /// One run; errors pass through. A gradient's motion is not looked at. `result`: all that the run gives; `budget`:
  /// what it may take.
  TradeValues run(const Combination& c, double rtol, double step_s, GradientResult* result = nullptr,
                  const Recording* recording = nullptr, const RunBudget* budget = nullptr) const;
  TradeValues run(const Combination& c, double rtol, double step_s, const RunBudget& budget) const {
    return run(c, rtol, step_s, nullptr, nullptr, &budget);
  }
  /// The same of a problem as prepared() gives it; no method: a simulation.
  TradeValues run(const Problem& prepared, const std::string& method, GradientResult* result = nullptr,
                  const Recording* recording = nullptr) const;
  /// The same, plain: for the clock.
  void repeat(const Combination& c, double rtol, double step_s) const;

  const Problem& problem() const { return problem_; }
  const std::vector<double>& rho() const { return rho_; }
  const std::vector<double>& times() const { return times_; }
  const std::vector<std::unique_ptr<Output>>& outputs() const { return outputs_; }
  /// How many of them are not besides.
  std::size_t counted() const { return counted_; }

 private:
  void look(TradeMotion& motion, const MechanismState& s, System& system) const;
  /// Sum of |y_q q| and |y_v v| of each output, the largest so far.
  void look_at_amounts(TradeMotion& motion, const MechanismState& s, Assembly& assembly) const;
  Problem problem_;
  std::vector<double> rho_, times_;
  std::vector<std::unique_ptr<Output>> outputs_;
  std::size_t counted_;
  std::unique_ptr<Output> energy_, kinetic_;
  std::unique_ptr<Assembly> assembly_;  // of its own: the run's results stay as they are
  std::unique_ptr<std::mutex> looks_ = std::make_unique<std::mutex>();  // one at a time at the assembly
};

}  // namespace costate
