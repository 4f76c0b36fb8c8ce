// A mechanism in other units: millimetres, tonnes, milliseconds, as other programs have them. Every number of the scene
// is another one, psi and what is derived from it are the same times known factors.
#pragma once

#include "judge.h"
#include "truss.h"

namespace costate::adversary {

/// How many of the new unit one m, kg and s are.
struct Units {
  const char* name;
  double length, mass, time;
};
const std::vector<Units>& all_units();

/// The same motion; weights of costs take up their units, so that psi is the same number.
Truss in_units(const Truss& truss, const Units& units);
/// By how much the parameter's number grows.
double growth(const Parameter& parameter, const Units& units);
/// What is right of the truss in other units.
Truth in_units(const Truth& truth, const Truss& truss, const Units& units);

}  // namespace costate::adversary
