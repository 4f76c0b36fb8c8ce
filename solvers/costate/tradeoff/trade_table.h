// What a study of accuracy against cost has measured: one row a run, errors against a reference, and what it took.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// What an error is of. `outputs`: the largest along the motion of those chosen, each against its own unit.
enum class TradeMeasure { psi, outputs, gradient };
inline constexpr std::array<TradeMeasure, 3> kTradeMeasures = {TradeMeasure::psi, TradeMeasure::outputs,
                                                               TradeMeasure::gradient};
const char* name_of(TradeMeasure measure);

struct Combination {
  std::string formulation, integrator;  // "idas", "cvodes", "fixed"; of hand-derived equations "radau"
  std::string method = {};              // of a gradient; empty: a plain simulation
  bool soft = false;                    // constraints hold up to O(1/alpha)
  /// "penalty on cvodes", "penalty by cvodes-adjoint".
  std::string name() const;
};

enum class TradeStatus { ok, failed, cut, left_out };
const char* name_of(TradeStatus status);

struct TradeRow {
  std::size_t combination = 0;  // into TradeTable::combinations
  double rtol = 0, step_s = 0;  // one of them is the accuracy asked for; the other is 0
  std::size_t level = 0;        // how many looser settings the combination has
  TradeStatus status = TradeStatus::left_out;
  std::string why = {};                             // it did not end
  double psi = 0;                                   // the value itself
  std::array<std::optional<double>, 3> error = {};  // relative, by measure
  std::string worst = {};                           // the output, or the parameter, farthest off
  double besides = 0;                               // of the outputs of which nothing is asked (TradeProbe), and
  std::string worst_besides = {};                   // the farthest of them
  /// Largest |Phi| and |Phid| of a row along the motion [SI]; the energy's largest change against the largest kinetic
  /// energy, where energy should be kept.
  std::optional<double> position_drift = {}, velocity_drift = {}, energy_drift = {};
  Counters counters = {};
  double time_s = 0;  // processor time: the median of `repeats` interleaved runs, or of the first (0)
  int repeats = 0;
  std::vector<std::string> warnings = {};

  std::optional<double> error_of(TradeMeasure m) const { return error[static_cast<std::size_t>(m)]; }
  /// "rtol 1e-06", "steps of 0.001 s".
  std::string setting() const;
};

struct TradeTable {
  std::vector<Combination> combinations;
  std::vector<TradeRow> rows;
  /// By measure: errors below are not certified by the reference.
  std::array<double, 3> floor = {0, 0, 0};
  double floor_of(TradeMeasure m) const { return floor[static_cast<std::size_t>(m)]; }
};

/// Residuals or right-hand sides and Jacobians, forward and backward, of state and sensitivities.
long callbacks(const Counters& c);

}  // namespace costate
