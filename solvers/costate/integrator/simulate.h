// A plain simulation: psi, counters, and samples of the motion for files and reports.
#pragma once

#include <functional>
#include <vector>

#include "costate/integrator/integrators.h"
#include "costate/problem/problem.h"

namespace costate {

/// Receives the mechanism's state at each sample time; accelerations and multipliers are consistent.
using SampleSink = std::function<void(const MechanismState& state, System& system)>;

/// psi at the parameters rho; samples (increasing times within the span) go to the sink.
Simulation simulate(const Problem& problem, const std::vector<double>& rho,
                    const std::vector<double>& sample_times = {}, const SampleSink& sink = {});

}  // namespace costate
