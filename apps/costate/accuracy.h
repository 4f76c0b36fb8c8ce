// --accuracy and [run] accuracy: a result's accuracy in the place of tolerances (tradeoff/accurate_run.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "command.h"
#include "costate/tradeoff/accurate_run.h"

namespace costate::app {

struct AccuracyOption {
  std::optional<double> value;

  void add_to(Command& command);
  /// Of the command line, or of the scene where the command line gives no tolerance either.
  std::optional<double> asked(const Setup& setup, const CommonOptions& common) const;
};

/// Gives notice that the scene's accuracy, if it asks for one, is not held, and why.
void notice_accuracy_left(const Setup& setup, const std::string& why);

/// What a simulation stores: these outputs, which the accuracy is then of, or all that the motion determines.
struct StoredOutputs {
  std::vector<std::string> named = {};
  bool all = false;
};

/// Chooses and runs; the setup then holds the choice. Gives notice where the request could not be met.
AccurateRun run_accurately(Setup& setup, const CommonOptions& common, double accuracy, bool gradient,
                           const StoredOutputs& stored = {}, const BeginRecording& begin = {});

/// What was tried for a choice.
Json pilots_json(const std::vector<AccuracyPilot>& pilots);
/// The contract's object `accuracy`.
Json accuracy_json(const AccurateRun& run, double accuracy);
/// What was asked for, chosen and reached, in a line or two.
std::string accuracy_text(const AccurateRun& run, double accuracy);

}  // namespace costate::app
