// Limit cycles and periodic motions: the fixed point of a section's return map by Newton's method, its multipliers, and
// the derivatives of the fixed point, of the period and of the cost over one cycle (lib/README.md (18)).
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "costate/cycle/cycle_values.h"
#include "costate/cycle/multipliers.h"
#include "costate/cycle/return_map.h"

namespace costate {

struct CycleOptions {
  int max_iterations = 30;
  double accepted = 1e3;  // largest residual that counts as a fixed point, in tolerances
  bool estimate = true;   // repeat the search at a tenth and three hundredths of the tolerance: the last one's result,
                          // and errors by the largest difference
  bool derivatives = true;
  bool multiplier = false;                                       // of the largest multiplier, too: some ten runs more
  std::function<void(int iteration, double residual)> progress;  // or empty
};

/// A number with what it may be off by (0 where that was not estimated).
struct Estimated {
  double value = 0, error = 0;
};

struct CycleResult {
  std::vector<std::string> names, units;          // of the section's coordinates
  Eigen::VectorXd x, x_error;                     // the fixed point
  std::vector<std::string> state_names;           // of the whole mechanism: coordinates, NAME_dot, z.STATE
  std::vector<double> state;                      // at the fixed point
  Estimated period, travel, psi;                  // s, m, cost
  std::vector<std::complex<double>> multipliers;  // largest modulus first, without those that are 0 by construction
  double multiplier_error = 0;                    // of the largest
  double undecided = 0;                           // as near to 1 as this the largest tells nothing of stability
  double residual = 0;                            // |P(x) - x|, the largest entry in tolerances
  std::string worst;                              // the coordinate it is of
  int iterations = 0;
  // Rows: of the fixed point's entries; of the period, the travel, psi. Columns: parameters. Empty without any.
  Eigen::MatrixXd x_rho;
  Eigen::VectorXd period_rho, travel_rho, psi_rho;
  /// What they differ by from those of the looser searches; empty where that was not estimated.
  Eigen::MatrixXd x_rho_error;
  Eigen::VectorXd period_rho_error, travel_rho_error, speed_rho_error, psi_rho_error;
  /// Of the largest modulus (cycle/multiplier_derivative.h), with estimated errors; empty where they were not asked for
  /// or there is none. By what method, or why there is none.
  Eigen::VectorXd multiplier_rho, multiplier_rho_error;
  std::string multiplier_method;
  /// psi's derivatives by the cycle's own values, of a cost that may hold some.
  CycleValues psi_values = CycleValues::Zero();
  std::vector<RunEvent> events;
  MapValue map;                   // at x, with its derivatives by x
  std::vector<double> positions;  // first guesses there
  Counters counters;
  std::string integrator;

  double speed() const { return travel.value / period.value; }  // m/s
  double largest() const { return multipliers.empty() ? 0 : std::abs(multipliers.front()); }
  Eigen::VectorXd speed_rho() const { return (travel_rho - speed() * period_rho) / period.value; }
  CycleValues values() const { return {period.value, travel.value, speed(), largest()}; }
  /// None where the largest multiplier is as near to 1 as it may be off by: motions that conserve are not judged.
  std::optional<bool> stable() const;
};

/// From where the problem's start leads to the section for the first time. Throws SolverError where the search does not
/// converge (saying how far it came, by which coordinate, and what to do), ModelError for mistakes in [cycle].
CycleResult find_cycle(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho,
                       const CycleOptions& options = {});

}  // namespace costate
