// The motions before and after an optimization, of each of its runs, as files and for its page.
#pragma once

#include <functional>

#include "costate/record/trajectory_table.h"
#include "costate/scene/scene_file.h"
#include "design_setup.h"

namespace costate::app {

struct RunMotion {
  const Setup* setup;  // of the run
  std::string name;    // of the case; empty: the only run
  /// By the run's own parameters: none where a motion could not be computed.
  std::vector<double> rho_before, rho_after;
  std::optional<TrajectoryTable> before, after;
};

/// Writes before.h5, after.h5 (before_CASE.h5, ...) and the same as CSV. What fails is told to `note`.
std::vector<RunMotion> write_motions(const DesignSetup& setup, const std::vector<double>& first,
                                     const std::vector<double>& best, const Json& settings,
                                     const std::function<void(const std::string&)>& note);

/// What an earlier run left in the folder does not belong to the evaluations that are made now. A file that the scene
/// itself consists of stays until it is replaced.
void remove_old_results(const DesignSetup& setup, const std::vector<SceneFile>& files);

}  // namespace costate::app
