// What errors are measured against, and how far that can be trusted: two runs at tight tolerances that share neither
// formulation nor integrator, and what they agree to.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "costate/tradeoff/trade_probe.h"

namespace costate {

struct TradeReference {
  Combination first, second;  // simulations; `first` is what errors are measured against
  double rtol_first = 0, rtol_second = 0;
  std::string gradient_first, gradient_second;  // methods; empty without gradients
  TradeValues values;                           // of the first, with the gradient
  /// Of two independent combinations that agree to two digits at least. Otherwise errors are distances to `first`, and
  /// nothing is certified.
  bool proven = false;
  /// By measure, relative: twice the distance of the two, or what `first` changed by over the last power of ten of its
  /// tolerance, whichever is larger.
  std::array<double, 3> floor = {0, 0, 0};
  // What errors are relative to.
  double psi_unit = 1, gradient_unit = 1;
  std::vector<double> output_unit;
  double energy_unit = 0;          // the largest kinetic energy; 0: the energy is not kept along this motion
  std::vector<std::string> notes;  // what was tried and did not serve

  /// Sets the units from the values.
  void measure(const TradeProbe& probe);
  /// Relative errors of values, by measure, and what was worst; those that the values do not hold stay empty.
  void judge(const TradeValues& values, const TradeProbe& probe, TradeRow& row) const;
};

struct ReferenceSearch {
  bool redundant = false;  // only formulations that carry dependent rows
  bool gradient = false;
  double tightest = 1e-12;
  /// What the next run may take.
  std::function<RunBudget()> allow;
  /// Whether others may be tried where two agree already, but to few digits; empty: always.
  std::function<bool()> has_time = {};
};

/// Runs until two agree or none is left; the first of each integrator beside each other where there are jobs()
/// (record/jobs.h). Throws the last failure where no combination runs at all.
TradeReference find_trade_reference(const TradeProbe& probe, const ReferenceSearch& search);

}  // namespace costate
