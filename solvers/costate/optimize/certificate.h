// What the end of an optimization is worth: the conditions of first and second order at the point found
// (lib/README.md (13.10) to (13.12)). With x = rho / scale, active constraints psi_c <= upper and active
// bounds,
//   L(x) = psi + sum of mu_c (psi_c - upper) - z_lower^T (x - lower) + z_upper^T (x - upper),   mu, z >= 0
// first order is dL/dx = 0; second order, the Hessian of L on the directions that keep what is active.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

struct Certificate {
  /// One sentence: "strict local minimum: ...", "stationary, ...", "not stationary: ...".
  std::string verdict;
  enum class Kind {
    strict_minimum,
    flat,
    indefinite,
    stationary,
    not_stationary,
    not_feasible,
    none  // the Hessian belongs to another motion than the optimum: nothing is said
  } kind = Kind::not_stationary;

  double projected_gradient = 0;  // of psi, largest entry in scaled parameters, bounds respected
  /// Largest of |dL/dx|, mu_c (psi_c - upper) and of the constraints' violations over the larger of 1 and
  /// |upper|.
  double kkt_residual = 0;
  double tolerance = 0;  // what counts as zero in kkt_residual

  std::vector<std::string> active;  // "L02.lower", "constraint.impulse"
  std::vector<std::string> free;    // parameters on no active bound
  /// Constraints that the point does not meet, and by how much, in their own units: there is no verdict on a minimum.
  std::vector<std::pair<std::string, double>> violated;
  /// Of what is active: what psi gains by a unit of that bound or `upper` (in their own units), >= 0 at a
  /// minimum.
  std::vector<std::pair<std::string, double>> multipliers;

  /// Of the Hessian of L in scaled free parameters on the directions that keep the constraints that a multiplier holds,
  /// ascending; empty when everything is active (nothing is left to move) or when there is no Hessian.
  std::vector<double> eigenvalues;
  /// Where these are all positive: Newton's step to the minimum, largest entry in scaled parameters, and what
  /// psi would fall by along it; -1 elsewhere.
  double newton_step = -1, predicted_decrease = -1;
  /// The slope of L along a direction of no curvature, where that is no rounding; 0 elsewhere.
  double flat_slope = 0;
  /// Where the least is negative: every such direction leaves, either way, a bound or constraint that is touched.
  bool falls_outward = false;
  double curvature_tolerance = 0;  // what counts as zero among them
  std::string formulation;         // the Hessian's; empty: there is none
  std::string note;                // why not the run's own formulation, or why there is none
  double asymmetry = 0;            // of the Hessian as computed, relative to its largest entry
  double eigenvalue_error = 0;     // what is known of how far the eigenvalues are off
};

/// At an evaluation of an optimization (its psi, gradient and constraints are those of `method`); `first` is
/// the evaluation it began with, whose gradient is the measure where there is no Hessian. Where no exact second
/// derivatives are offered (events, cycles) they are differences of gradients by `method`, and the note says so.
///
/// Of the worst of several targets L(x) = F_w + sum of mu_g (F_g - F_w), w the worst: the rows "worst.NAME" of the
/// targets that are as bad, with multipliers that add up to 1.
Certificate certify(const Design& design, const OptimizerEvaluation& first, const OptimizerEvaluation& best);
/// Of one run alone.
Certificate certify(const Problem& problem, const std::vector<OptimizerConstraint>& constraints,
                    const OptimizerEvaluation& first, const OptimizerEvaluation& best, const std::string& method);

}  // namespace costate
