// How much of a long sweep the suite takes: over every slip of every term, over every parameter of every formulation.
// What is left out in one place is taken in another (each formulation begins elsewhere); `test/sweep` takes all of it.
#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate::test {

inline bool sweeps_are_whole() {
  const char* s = std::getenv("COSTATE_SWEEP");
  return s && std::string(s) == "whole";
}

/// One of how many: `suite` in the suite, more of what goes the same way through memory under the sanitizers, 1 in a
/// whole sweep.
inline int sweep_stride([[maybe_unused]] int suite, [[maybe_unused]] int sanitized) {
  if (sweeps_are_whole()) return 1;
#ifdef __SANITIZE_ADDRESS__
  return sanitized;
#else
  return suite;
#endif
}

/// Of the parameters every third, from the `turn`-th on; all of them in a whole sweep.
inline ParameterSelection some_of(const ParameterSelection& all, std::size_t turn) {
  const auto stride = static_cast<std::size_t>(sweep_stride(3, 6));
  ParameterSelection some;
  for (std::size_t j = turn % stride; j < all.parameters.size(); j += stride)
    some.parameters.push_back(all.parameters[j]);
  return some;
}

}  // namespace costate::test
