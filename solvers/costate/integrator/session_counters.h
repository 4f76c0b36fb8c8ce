// The counters of a run that takes several sessions of an integrator.
#pragma once

#include <algorithm>

#include "costate/problem/problem.h"

namespace costate {

/// Adds those of another session of the same run. The system's own count on over all of them.
inline void add_session(Counters& sum, const Counters& c) {
  const long factorizations = std::max(sum.factorizations, c.factorizations),
             position_iterations = std::max(sum.position_iterations, c.position_iterations);
  sum += c;
  sum.factorizations = factorizations;
  sum.position_iterations = position_iterations;
  sum.simulations = 1;
}

}  // namespace costate
