// What costate optimize and costate pareto may be told besides the scene.
#pragma once

#include <optional>
#include <string>

#include "accuracy.h"
#include "costate/optimize/optimizer.h"
#include "design_setup.h"

namespace costate::app {

struct OptimizeOptions {
  bool resume = false, no_certificate = false, no_report = false, adapt = false;
  std::optional<int> max_evaluations;
  std::optional<double> stop_value;
  double step_limit_factor = OptimizerOptions{}.step_limit_factor;
  std::string algorithm, goal;
  AccuracyOption accuracy;
  int jobs = 0;

  void add_to(Command& command);
  /// Those of the optimizer itself.
  void add_search(Command& command);
};

/// The scene's settings with the command line's, checked before anything is computed or written.
OptimizerOptions optimizer_options(const DesignSetup& setup, const OptimizeOptions& options);

}  // namespace costate::app
