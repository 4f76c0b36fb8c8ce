// One run from a state to the section (return_map.h): what is read where it ends, and the derivatives of that by all of
// the problem's parameters, from the integrator's own forward sensitivities.
#pragma once

#include <Eigen/Core>

#include "costate/cycle/section.h"

namespace costate {

struct MapRun {
  double t = 0, psi = 0;
  Eigen::VectorXd values;         // of the section's coordinates, then of what it carries along, if it does
  Eigen::MatrixXd rows;           // derivatives of these, of the end time and of psi; empty unless asked for
  Eigen::VectorXd kappa;          // of each of these rows; zero with a period
  std::vector<double> positions;  // of all coordinates at the end
  std::vector<double> modes;      // of the section's, at the end
  std::vector<RunEvent> events;   // the one that ends the run included
  Counters counters;
  std::string integrator;
};

/// On the problem's integrator, idas or cvodes. Throws SolverError where the section is never met, or hardly crossed.
MapRun run_to_section(const Problem& problem, const std::vector<double>& values, const Section& section,
                      bool differentiate);

}  // namespace costate
