// A run that is asked for by the accuracy of its result. Formulation and integrator are chosen by short runs over the
// first part of this very problem (pilot_race.h), then the tolerance is tightened until two runs show that the errors
// of psi, of the gradient and of the outputs along the motion are within the request: error_order.h tells what a
// difference makes of an error. The adjoint-weighted defect is no way to it here: it knows psi's error alone, not those
// of the outputs or of the gradient, and costs an adjoint where a looser run costs two thirds to nine tenths of what it
// judges.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/tradeoff/pilot_race.h"
#include "costate/tradeoff/trade_probe.h"

namespace costate {

struct AccuracyRequest {
  /// Of psi against itself, of outputs against what they range over, of a derivative in its parameter's scale against
  /// the largest.
  double accuracy = 1e-4;
  std::string formulation, integrator, method;  // chosen by the user; empty: here
  bool gradient = false;
  std::vector<std::string> outputs;
  std::vector<std::string> besides = {};  // stored, too: what these are off by is told
};

struct AccurateRun {
  Problem problem;    // as it was chosen
  Combination what;   // of a gradient with its method
  bool met = false;   // or the tolerance cannot be tightened any further
  double looser = 0;  // rtol of the run that the result is compared with
  double psi_error = 0;
  double outputs_error = 0;            // relative; the largest of all outputs and samples
  std::vector<double> gradient_error;  // an entry a parameter
  double relative = 0;                 // the largest of all as the request counts them
  std::string worst;                   // what that is of
  double besides_error = 0;            // the largest of what is stored besides, as of outputs
  std::string worst_besides;
  /// Of when its events happen [s]; none where the looser run has another number of them.
  std::optional<double> times_error = 0;
  std::vector<AccuracyPilot> pilots;
  int runs = 0;  // behind the pilots
  GradientResult result;

  /// All errors so many times as large.
  void widen(double times);
  /// To the errors that two runs tell: what both have alike, whatever their tolerances. `accuracy`: asked for.
  void add_what_stays(double accuracy);
};

/// The largest difference of two runs' times of events, or nothing where one has more of them.
std::optional<double> times_apart(const std::vector<double>& a, const std::vector<double>& b);

/// Where each attempt at the final run of a simulation is recorded anew; empty: nowhere.
using BeginRecording = std::function<TradeProbe::Recording(const Problem& chosen)>;

/// Gives notice where another combination's pilot is farther off than its tolerance explains. Throws CapabilityError
/// where the user's choice cannot be held to an accuracy, and what the runs throw.
AccurateRun run_to_accuracy(const Problem& problem, const std::vector<double>& rho, const AccuracyRequest& request,
                            const BeginRecording& begin = {});

/// "baumgarte by cvodes-adjoint, rtol 3e-06; errors by a run at rtol 3e-05".
std::string text_of(const AccurateRun& run);

}  // namespace costate
