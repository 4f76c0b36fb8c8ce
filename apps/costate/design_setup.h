// A scene as gradient, optimize and pareto take it: one run, or the cases that it lists ([[case]]) as one design.
#pragma once

#include "command.h"
#include "costate/optimize/design.h"

namespace costate::app {

struct DesignSetup {
  /// Mistakes name the option or the place in the scene, before anything has been computed or written. `goal`: of the
  /// command line, or empty.
  explicit DesignSetup(const CommonOptions& common, const std::string& goal = {});

  std::vector<SceneCase> of;  // what was said of each case
  Setup setup;                // of the scene that was named: parameters, files, what [optimize] says
  std::vector<Setup> cases;   // their runs; empty: `setup` is the only one

  bool several() const { return !cases.empty(); }
  /// With the runs' problems as they are now. `this` must outlive it.
  Design design() const;
  /// Each run ends on Ctrl-C; the only or the first one shows its progress.
  void watch(Progress& progress);
  /// The contract's list `cases`: each one's settings with its psi and gradient.
  Json cases_json(const std::vector<double>& psi, const std::vector<std::vector<double>>& gradients) const;
  /// What identifies them in a journal.
  nlohmann::json identity() const;
  /// The part of a summary that is of no run alone: `formulation`, `integrator` and `method` where all cases have the
  /// same, else null; `rtol`, the loosest; `goal`.
  void correct(Json& summary) const;
  /// "the sum of 2 cases".
  std::string what() const;
  /// A line for each case, with its psi, and what it became.
  std::string cases_text(const std::vector<double>& psi, const std::vector<double>& after = {}) const;
  /// What is known of psi relatively (digits.h): the loosest tolerance; 0 where it is that of the runs' own steps.
  double psi_tolerance() const;
  /// Throws where an accuracy is asked for, by the command line or by a case's [run], that several cases cannot have.
  void refuse_accuracy(bool on_command_line) const;

 private:
  void add_case(const CommonOptions& common, const SceneCase& c);

  Design::Goal goal_ = Design::Goal::sum;
};

/// Throws where the run's scene may not have these values of its parameters, as a reader of optimized.toml would.
void require_scene(const Setup& setup, const std::vector<double>& rho);

/// --goal
void add_goal_option(Command& command, std::string& goal);

/// The case's scene with the design's parameters at their values, which are the ones that it varies; for --case NAME.
Scene scene_of_case(const Scene& design, const std::string& name, const std::vector<std::string>& parameters,
                    const std::vector<std::string>& overrides);

}  // namespace costate::app
