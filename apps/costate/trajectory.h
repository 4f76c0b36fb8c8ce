// Samples of a run collected into a table for HDF5 and CSV, and the progress monitor of a run.
#pragma once

#include <optional>
#include <string>

#include "command.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/redundant_rows.h"
#include "costate/record/trajectory_table.h"

namespace costate::app {

class TrajectoryRecorder {
 public:
  /// Samples every `step` seconds, or as the scene says, or 500 times, of the run at rho; or, for terminal() alone,
  /// only what that needs. Of everything, or of `chosen` outputs alone.
  TrajectoryRecorder(const Setup& setup, const std::vector<double>& rho, std::optional<double> step,
                     bool only_end = false, const std::vector<std::string>& chosen = {});
  const std::vector<double>& times() const { return times_; }
  SampleSink sink();
  const TrajectoryTable& table();
  /// The last sample by the names of outputs: coordinates, NAME_dot, NAME_ddot, lambda.ROW, z.STATE and the outputs.
  Json terminal();
  /// The units of terminal().
  Json units() const;
  /// Gives notice of reactions among the samples that the motion does not determine.
  void tell_of_open_reactions() { open_->tell(); }
  /// The table with the scene inside, and the events of the run; `settings` is stored as JSON.
  TrajectoryTable finish(const Json& settings, const Simulation& run = {});

 private:
  void prepare(const Mechanism& mechanism);
  void choose(const Mechanism& mechanism, const std::vector<std::string>& chosen);
  /// Moves the collected samples to the columns, with the outputs there.
  void store_collected();
  const Setup& setup_;
  std::vector<double> rho_;
  std::vector<double> times_;
  std::vector<std::unique_ptr<Output>> outputs_;
  bool whole_ = true;  // whether all of the state has columns, before those of the outputs
  TrajectoryTable table_;
  // States of the samples that have no values in the columns yet: of a hundred thousand outputs, each somewhere else in
  // memory, several values at once cost hardly more than one. Outputs are functions of the state and the numbers, which
  // an assembly of its own has.
  std::vector<double> collected_;
  Assembly assembly_;
  std::optional<OpenReactions> open_;
};

/// A sentence for each column that holds what is no number.
std::vector<std::string> not_finite_remarks(const TrajectoryTable& table);

/// Writes NAME.h5 (and NAME.csv); returns the paths of what was written.
std::vector<std::string> write_trajectory(const Setup& setup, const TrajectoryTable& table, const std::string& name,
                                          bool csv);

/// The motion that psi is of at rho, sampled as the recorder does: of a psi over a cycle the one that begins there.
TrajectoryTable shown_trajectory(const Setup& setup, const std::vector<double>& rho, const Json& settings);

/// Shows progress and stops on Ctrl-C.
Monitor monitor(Progress& progress, double t_end);

}  // namespace costate::app
