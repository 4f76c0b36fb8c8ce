// The laws of time of a mechanism's forces and of its running costs, with the numbers of the mechanism that are theirs:
// where one of them jumps, and a parameter moves the place, the derivatives under the integral miss what the jump does
// (fixed_times.h). Drivers, and roads that move under something, tell of their places themselves.
#pragma once

#include <string>
#include <vector>

#include "costate/element/law/scalar_law.h"
#include "costate/mechanism/mechanism.h"
#include "costate/objective/objective.h"

namespace costate {

struct TimeLaw {
  const ScalarLaw* law;
  std::vector<int> numbers;  // of the law, in order, in the mechanism
  std::string kind, name;    // of what has it
};
/// All of them.
std::vector<TimeLaw> laws_of_time(const Mechanism& mechanism, const Objective& objective);
/// The places of laws of drivers with a number that parameters move, whatever happens there.
std::vector<double> places_of_moved_drivers(const Mechanism& mechanism, const ParameterSelection& parameters,
                                            const std::vector<double>& numbers);
/// Whether a parameter sets this number of the mechanism's.
bool is_moved(int number, const ParameterSelection& parameters);
/// Those with a number that parameters move.
std::vector<TimeLaw> moved_laws_of_time(const Mechanism& mechanism, const Objective& objective,
                                        const ParameterSelection& parameters);

}  // namespace costate
