// One of the two scenes that 'costate compare' holds beside each other, and what it gave.
#pragma once

#include <string>
#include <vector>

#include "command.h"
#include "trajectory.h"

namespace costate::app {

struct CompareSide {
  Setup setup;
  GradientResult result = {};  // counters of the plain simulation; psi, and the gradient if there is one, with what is
                               // known of their errors
  double simulation_s = 0, gradient_s = 0;
  TrajectoryTable motion = {};

  const Mechanism& mechanism() const { return *setup.problem.mechanism; }
  bool has_cost() const {
    const Objective& o = setup.problem.objective;
    return !o.running.empty() || !o.terminal.empty();
  }
  /// Runs the scene, its motion to `end` at so many intervals, confirmed by these outputs; and its gradient, if the
  /// problem has parameters and `differentiates`. What is noticed is left to take.
  void run(double end, long samples, const std::vector<std::string>& outputs, bool differentiates);
};

/// With the values that `set` replaces in it, beside those of the command line.
CompareSide make_compare_side(const CommonOptions& common, const std::string& scene,
                              const std::vector<std::string>& set, bool differentiate);

}  // namespace costate::app
