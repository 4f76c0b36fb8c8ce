// What a limit cycle is as a whole, as outputs for costs and constraints on it: cycle.period, cycle.travel, cycle.speed
// and cycle.multiplier, the largest modulus. Along a motion they hold still: each is a number of the mechanism, which
// whoever finds the cycle sets and differentiates by (solvers/costate/cycle/cycle_values.h).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/objective/output.h"

namespace costate {

class MechanismBuilder;

/// In this order.
inline constexpr int kCyclePeriod = 0, kCycleTravel = 1, kCycleSpeed = 2, kCycleMultiplier = 3, kCycleValues = 4;

/// "cycle.period", ...: names of the outputs, and of the numbers.
const std::vector<std::string>& cycle_value_names();

/// What the numbers are until a cycle has been found, numbers of a mechanism being finite: the outputs are nan then.
inline constexpr double kUnknownCycleValue = -0.0;
/// Adds the numbers.
void add_cycle_values(MechanismBuilder& builder);
/// Their indices, or nothing where the mechanism has none.
std::vector<int> cycle_value_numbers(const Mechanism& mechanism);

/// Null where the name is none of these, or the mechanism has no such numbers.
std::unique_ptr<Output> make_cycle_output(const Mechanism& mechanism, const std::string& name);

}  // namespace costate
