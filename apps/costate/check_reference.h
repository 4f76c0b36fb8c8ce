// The reference of 'costate check': the most accurate gradient at hand, how far it may be from the truth, and the sizes
// that errors are measured against.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "check_judge.h"
#include "costate/integrator/run_budget.h"

namespace costate::app {

struct CheckReference {
  Yardstick yardstick;
  double apart = 0, estimate = 0;  // from differences, and their own estimate; relative
  bool proven = false;             // by differences
  bool agrees = true;              // with them
  std::string worst;               // the component farthest from them
  std::string note;                // why they did not prove it, or why it is no tighter; or empty
  /// Where psi is far below the problem's: all rows take these, or they would have their errors, and differ by them.
  std::optional<AbsoluteTolerances> tolerances;
  double seconds = 0, steps = 0;  // of its run, processor time: what others are allowed a multiple of
};

/// Nothing is cut before it has taken as much as this would with such a factor.
inline constexpr double kLeastSeconds = 0.05, kLeastSteps = 1000;
/// Differences make up to 22 runs a parameter; how much more time they get than one gradient.
inline constexpr double kDifferencesShare = 5;
/// Half of what it is relative to: as far apart no digit is common.
inline constexpr double kNoDigit = 0.5;
/// Where the reference has no digit nothing can be found right: rows are run once, in this part of the time.
inline constexpr double kNoDigitShare = 0.25;

/// An exact-constraint formulation, forward sensitivities, three digits tighter where it can be followed that far;
/// judged itself by differences that use no derivative block. `redundant` rows want a formulation that carries them.
/// `budget` is looked at by the problem's monitor. Differences run on `jobs` cores (0: all).
CheckReference find_reference(const Problem& problem, const std::vector<double>& rho, bool redundant, double patience,
                              RunBudget& budget, int jobs);

}  // namespace costate::app
