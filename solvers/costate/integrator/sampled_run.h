// Runs whose cost has samples (objective/sampled_cost.h): they go from one to the next, and an adjoint jumps there by
// that of each sample's own terms, as at an end of its own; the equations are linear, so that it adds up.
#pragma once

#include <type_traits>
#include <vector>

#include "costate/base/error.h"
#include "costate/integrator/segment.h"
#include "costate/objective/sampled_cost.h"
#include "costate/problem/problem.h"

namespace costate {

/// The same problem with its cost's samples separated, for systems; as it is without samples. Throws CapabilityError
/// where they lie outside the run, or its end follows from an event or a cycle.
Problem with_separate_samples(const Problem& problem);

/// Goes to the samples in order of time: go(t, index) comes there and returns the state, and `here` is told while the
/// sample's terms are the system's terminal cost. Returns their sum. Nothing where there are none.
template <class Go, class Here>
double advance_over_samples(System& system, const Problem& problem, const Go& go, const Here& here) {
  const SampleTerm* samples = sample_term(system.objective());
  if (!samples) {
    if (has_samples(problem.objective)) throw Error("The samples of this cost have not been separated.");
    return 0;
  }
  double sum = 0;
  for (std::size_t i = 0; i < samples->times().size(); ++i) {
    const double t = samples->times()[i];
    const double* y = go(t, i);
    const OpenSample open(*samples, i);
    sum += system.terminal_cost(t, y);
    here();
  }
  return sum;
}
template <class Go>
double advance_over_samples(System& system, const Problem& problem, const Go& go) {
  return advance_over_samples(system, problem, go, [] {});
}

/// For SegmentedRun::solve_adjoint().
template <class SystemType>
auto sample_adjoint(SystemType& system) {
  return [&system](std::size_t index, double t, const std::vector<double>& y, const std::vector<double>& yp,
                   AdjointState& mu, std::vector<double>& gradient) {
    const OpenSample open(*sample_term(system.objective()), index);
    AdjointState own;
    own.mu.assign(y.size(), 0);
    if constexpr (std::is_base_of_v<DaeSystem, SystemType>) {
      own.mup = own.mu;
      system.terminal_adjoint(t, y.data(), yp.data(), own.mu.data(), own.mup.data(), gradient.data());
    } else {
      system.terminal_adjoint(t, y.data(), own.mu.data(), gradient.data());
    }
    for (std::size_t i = 0; i < own.mu.size(); ++i) mu.mu[i] += own.mu[i];
    for (std::size_t i = 0; i < own.mup.size(); ++i) mu.mup[i] += own.mup[i];
  };
}

}  // namespace costate
