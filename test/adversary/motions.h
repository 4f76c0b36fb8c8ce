// What runs store: every output of a motion at sample times, by any formulation on any integrator, against that of two
// others on two other integrators at a tight tolerance; reactions where the motion determines them.
#pragma once

#include "judge.h"

namespace costate::adversary {

struct Sampled {
  std::vector<std::string> names, units;
  std::vector<double> times;
  std::vector<std::vector<double>> values;  // by sample, then by output
  std::vector<bool> open;                   // by output: not determined by the motion
  std::vector<double> slopes;               // by output: what an error of positions and velocities makes of it
  double psi = 0;
  std::string said;  // notices
  /// What `costate simulate` says besides, which confirms its motion by other runs.
  std::function<std::string()> confirmed;
  std::size_t events = 0;  // contacts, latches
};

/// All outputs at `samples` times that are not round. Errors pass through.
Sampled sample(const std::string& scene, const std::string& formulation, const std::string& integrator, double rtol,
               int samples);

/// What `costate simulate` says besides of such a run, as it confirms the motion by other ones.
std::string said_by_confirmation(const std::string& scene, const std::string& formulation,
                                 const std::string& integrator, double rtol);

/// Every formulation on every integrator that carries it.
std::vector<std::pair<std::string, std::string>> runs_of_motions();

/// The motions of a scene by these, at rtol 1e-8.
std::vector<Finding> run_motions(const std::string& scene,
                                 const std::vector<std::pair<std::string, std::string>>& runs);

}  // namespace costate::adversary
