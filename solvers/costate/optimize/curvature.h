// Second derivatives of a run's costs at the end of an optimization: exact ones by the run's own formulation where it
// has them, else by another one, else differences of the run's own gradients.
#pragma once

#include <string>
#include <vector>

#include "costate/problem/problem.h"
#include "costate/sensitivity/hessian.h"

namespace costate {

struct Curvature {
  std::vector<Hessian> of;  // of each objective asked for, in their order; empty: there is none
  std::string formulation;  // whose these are
  std::string note;         // why not the run's own formulation, or why there is none
};

/// At the problem's tolerance or `loosest`, whichever is larger; with a `loosest` above zero exact
/// ones alone, whose error the caller judges.
Curvature find_curvature(const Problem& problem, const std::string& method, const std::vector<double>& rho,
                         const std::vector<const Objective*>& objectives, double loosest = 0);

}  // namespace costate
