// psi over a cycle that was found as a functional of one return, psi + l^T P + psi_T T + psi_s s (lib/README.md (18.6),
// (18.10)): what adjoints and second derivatives of psi over the cycle are taken of.
#pragma once

#include <vector>

#include "costate/cycle/cycle.h"
#include "costate/cycle/cycle_start.h"
#include "costate/cycle/cycle_values.h"

namespace costate {

class CycleLagrangian {
 public:
  /// Of the cycle that find_cycle() has found with derivatives by the state.
  CycleLagrangian(const Problem& problem, const std::vector<double>& rho, const CycleResult& cycle);

  const Section& section() const { return start_.section(); }
  /// Whether the cycle's own values are parameters of the map, behind rho.
  bool valued() const { return valued_; }
  /// At the cycle's own values.
  const ReturnMap& map() const { return map_; }
  /// l, and psi's derivatives by T and s.
  const CycleWeights& weights() const { return weights_; }

 private:
  CycleStart start_;
  bool valued_;
  ValuedProblem with_;
  ReturnMap map_;
  CycleWeights weights_;
};

}  // namespace costate
