// costate cycle --accuracy: the formulation, the integrator and the tolerance that a cycle needs to be known so well.
#pragma once

#include <optional>

#include "command.h"
#include "costate/cycle/cycle.h"

namespace costate::app {

struct AccurateCycle {
  CycleResult result;
  double relative = 0;  // the largest of the errors, as the request counts them
  std::string worst;    // what that is of
  bool met = false;
  Json json;  // the contract's object `accuracy`
};

/// Errors are those of searches at a tenth and three hundredths of the tolerance: of the period, the travel and psi
/// against themselves, of the fixed point against the largest that is comparable (cycle/cycle_errors.h), of the largest
/// multiplier against itself or 1, of derivatives (but for the multiplier's) in the parameters' scales against the
/// largest of their kind. The setup then holds the choice. Gives notice where the request could not be met.
AccurateCycle find_accurate_cycle(Setup& setup, const CommonOptions& common, double accuracy, CycleOptions options);

}  // namespace costate::app
