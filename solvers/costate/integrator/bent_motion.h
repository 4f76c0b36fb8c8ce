// Runs whose errors fall by fits and starts: over bends of forces and costs, and over events. Where they fall with the
// tolerance the change from a looser run tells an error; here two runs may be near each other by chance.
#pragma once

#include "costate/problem/problem.h"

namespace costate {

/// Whether forces or running costs bend along motions, at the parameters' values.
bool may_bend(const Problem& problem);

/// Of the run's integrator: Runge-Kutta schemes pass bends whose places are known by steps of their own.
bool falls_by_fits(const Problem& problem, const Simulation& run);

}  // namespace costate
