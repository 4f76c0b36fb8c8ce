// Design optimization with exact gradients by NLopt (L-BFGS with bounds; MMA or SLSQP where constraints are given):
// parameter scaling, a stop that says which criterion ended it, every evaluation recorded and replayable.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "costate/sensitivity/problem.h"

namespace costate {

struct OptimizerOptions {
  std::string algorithm = "lbfgs";  // "lbfgs", "mma", "slsqp"
  int max_evaluations = 200;
  double stop_value = -std::numeric_limits<double>::infinity();  // stop once psi <= this
  double relative_tolerance = 1e-10;  // of psi between iterations
  double gradient_tolerance = 0;      // stop once the scaled projected gradient's largest entry <= this; 0: off
  int corrections = 10;               // vectors kept by L-BFGS
};

/// psi_c(rho) <= upper, where psi_c is a cost of its own.
struct OptimizerConstraint {
  std::string name;
  Objective objective;
  double upper = 0;
};

/// One evaluation of psi, of its gradient and of the constraints.
struct OptimizerEvaluation {
  int index = 0;  // from 1
  std::vector<double> rho;
  double psi = 0;
  std::vector<double> gradient;
  std::vector<double> constraints;                 // psi_c - upper, <= 0 when satisfied
  std::vector<std::vector<double>> constraint_gradients;
  double projected_gradient = 0;  // largest entry of the projected gradient in scaled parameters
  Counters counters;
  double wall_s = 0;
  bool replayed = false;
};

struct OptimizerResult {
  std::vector<OptimizerEvaluation> evaluations;
  std::size_t best = 0;     // into evaluations: the least psi among the feasible ones
  std::string stop_reason;  // a sentence naming the criterion
  bool converged = false;   // false when a limit or a failure of the line search ended it
};

/// Throws CapabilityError for an algorithm that does not exist or takes no constraints.
void require_algorithm(const std::string& algorithm, bool constrained);

/// `replay` holds the evaluations of an interrupted run, which are given back without being computed as long as the
/// optimizer asks for the same parameters bit for bit; `record` sees every evaluation as soon as it is known.
/// Throws what a simulation throws, with the evaluation named.
OptimizerResult optimize(const Problem& problem, const std::string& method,
                         const std::vector<OptimizerConstraint>& constraints, const OptimizerOptions& options,
                         const std::vector<OptimizerEvaluation>& replay,
                         const std::function<void(const OptimizerEvaluation&)>& record);

/// The version of NLopt in use, "2.7.1".
std::string nlopt_version_text();

}  // namespace costate
