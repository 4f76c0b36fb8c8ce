// Which formulation on which integrator is the fastest on a problem: short runs over the first part of its time, one
// after the other, each given up where it falls behind the best one before it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/integrator/integrators.h"
#include "costate/integrator/run_budget.h"
#include "costate/tradeoff/trade_table.h"

namespace costate {

/// A short run of one combination; `why` where it served as no choice.
struct AccuracyPilot {
  Combination what;
  double rtol = 0, time_s = 0;  // processor time
  double cost_s = 0;            // as it counts
  double until = 0;             // s, where it ended
  double psi = 0;
  std::string why;
};

class PilotRace {
 public:
  /// Whether a formulation may run on an integrator here.
  using Serves = std::function<bool(const Formulation&, const Integrator&)>;

  /// What a run's time counts, with what a gradient adds to it.
  using Weight = std::function<double(const Formulation&, const Integrator&)>;
  /// Explicit schemes run at so many times the others' tolerance, where their errors are theirs.
  struct Terms {
    double schemes_rtol = 1;
    Weight weight = {};  // empty: 1
  };
  /// Where rows are redundant, formulations that carry none are left out.
  PilotRace(const Problem& problem, const std::vector<double>& rho, bool redundant, Serves serves, Terms terms);

  /// Those that ended, the fastest first, at rtol or as much less as is needed for one to end. Throws the last failure
  /// where none does, CapabilityError where nothing serves.
  std::vector<AccuracyPilot> run(double rtol);
  /// All that were tried.
  const std::vector<AccuracyPilot>& pilots() const { return pilots_; }

 private:
  /// Processor time by simulated time, of the best run so far.
  struct Pace {
    std::vector<std::pair<double, double>> points;
    double at(double t) const;
  };
  std::vector<Combination> candidates(bool preferred) const;
  bool may(const Formulation& f, const Integrator& i) const;
  void heat(std::vector<Combination> waiting, double rtol, std::vector<AccuracyPilot>& ended);
  AccuracyPilot one(const Combination& c, double rtol);

  Problem problem_;
  const std::vector<double>& rho_;
  bool redundant_;
  Serves serves_;
  Pace best_, mine_;
  Terms terms_;
  double began_ = 0, weight_ = 1;
  double slice_ = 0;  // s; 0: without an end
  bool sliced_ = false;
  std::vector<AccuracyPilot> pilots_;
  std::exception_ptr failure_;
};

}  // namespace costate
