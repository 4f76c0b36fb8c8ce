// How far psi and its gradient are from those of the exact motion, as told by the farther of two more runs: at a tenth
// of the tolerance, or less where that takes no other steps, and at three hundredths; or at a half and a quarter of
// fixed steps. (One alone came near by chance one time in twenty, up to eighty-five times nearer than the exact
// motion.) No estimate is below a hundredth of the tolerance.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

struct ErrorEstimate {
  double psi = 0;
  std::vector<double> gradient;  // one entry a parameter; empty for a simulation
};

/// Of a simulation.
ErrorEstimate estimate_error(const Problem& problem, const std::vector<double>& rho, const Simulation& result);
/// Of a method's result.
ErrorEstimate estimate_error(const Problem& problem, const std::string& method, const std::vector<double>& rho,
                             const GradientResult& result);

/// Whether a run takes so many steps more than another one that what they differ by tells an error: of two with the
/// same steps, which something else than the tolerance bounds, it tells nothing.
bool takes_other_steps(long before, long steps);

/// What `estimate` makes, or nothing, with a notice, where a run that it takes fails: the result is none the worse.
std::optional<ErrorEstimate> estimate_or_tell(const std::function<ErrorEstimate()>& estimate);

/// Whether a formulation's constraints are soft, so that its motion differs from the exact one by O(1/alpha) at any
/// tolerance: the penalties, not all that carry redundant rows (the augmented Lagrangian iterates until the rows hold).
bool has_soft_constraints(const std::string& formulation);
/// The same problem with a weight ten times as large, which takes nine tenths of that difference away.
Problem with_firmer_constraints(const Problem& problem);

/// Of a gradient by a penalty: gives notice, and widens the known error, where its soft constraints change psi or the
/// gradient by more than some 1e-4, or where rounding does, as redundant rows under a large weight. Another run
/// (`run` makes it, as the gradient was made) tells, with another weight; it is made where rows are off by more than a
/// tolerance's part (`drift`, in lengths or lengths a second; infinite for motions that make much of it), or are so
/// times what parameters make of forces, or the weight is the user's and large; or where a hundred times that drift is
/// more than the result's known error, which then holds the difference.
void watch_penalty(const Problem& problem, const std::vector<double>& rho, GradientResult& result, double drift,
                   const std::function<GradientResult(const Problem&)>& run);

/// The same of psi alone, without a word.
void widen_by_softness(const Problem& problem, const std::vector<double>& rho, double drift, Simulation& result);

}  // namespace costate
