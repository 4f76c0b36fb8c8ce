// How large the unknowns of a mechanism are, for absolute tolerances: one number in SI units for every unknown would
// leave a mechanism of micrometres without digits.
#pragma once

#include <vector>

#include "costate/formulation/system.h"
#include "costate/mechanism/force_size.h"
#include "costate/mechanism/length_size.h"
#include "costate/problem/problem.h"

namespace costate {

/// As length_size() of its velocities, in such lengths or radians a second. Where nothing but its start moves a
/// mechanism (no force, no gravity, no row with a law of time) it has no other speed than those given there, and a slow
/// motion is a fast one with another clock: below 1e-3 the power of ten next above the largest, else 1.
double rate_size(const Mechanism& mechanism);

/// Whether it is a force, a torque, an energy or a power.
bool in_forces(const std::string& unit);
/// One an unknown: that length for what is measured in m, m/s or m/s^2, the unit of force for what is in N, N m or J,
/// else 1; times the rate for velocities.
std::vector<double> unknown_sizes(const System& system);

/// The absolute tolerance times these in the first entries of `out`, and times the cost's size in those behind the
/// system's unknowns, up to `size`; in parts of `scale`, of derivatives by what has this size.
void fill_absolute_tolerances(const System& system, const SolverOptions& options, int size, double* out,
                              double scale = 1);

/// Of the cost, whose unit it does not tell: the smallest that a square of lengths can have, and where it holds forces
/// (outputs in N or J, reactions) that times the square of these.
double cost_size(const Mechanism& mechanism, const Objective& objective);
inline double cost_size(const Problem& problem) { return cost_size(*problem.mechanism, problem.objective); }
/// What is smaller than this in psi, or in a derivative by what has the size of its parameter's scale, is nothing: a
/// small part of what is absolutely tolerated of it.
double negligible_cost(const Mechanism& mechanism, const Objective& objective, const SolverOptions& options);
inline double negligible_cost(const Problem& problem) {
  return negligible_cost(*problem.mechanism, problem.objective, problem.solver);
}
/// Of the cost's quadrature over a run: the absolute tolerance times that, in runs below a second as many parts of it.
double cost_tolerance(const System& system, const SolverOptions& options);

}  // namespace costate
