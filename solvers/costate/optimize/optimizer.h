// Design optimization with exact gradients by NLopt (L-BFGS with bounds; MMA or SLSQP where constraints are given):
// parameter scaling, a stop that says which criterion ended it, every evaluation recorded and replayable.
#pragma once

#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "costate/optimize/design.h"
#include "costate/scene/scene_settings.h"

namespace costate {

/// Where constraints are taken and no algorithm is asked for.
inline constexpr const char* kConstrainedAlgorithm = "slsqp";

/// What a scene's [optimize] may say, and what only the program may.
struct OptimizerOptions : OptimizeSettings {
  OptimizerOptions() = default;
  explicit OptimizerOptions(const OptimizeSettings& scene) : OptimizeSettings(scene) {}

  int corrections = 10;  // vectors kept by L-BFGS
  /// An evaluation fails that takes more than this many times the steps of any before it, in either direction of time
  /// (and more than kStepsAlwaysAllowed); 0: only the solver's own limit holds.
  double step_limit_factor = 100;
  static constexpr long kStepsAlwaysAllowed = 10000;
  /// Evaluations loosen the problem's tolerance far from the optimum (adapted_tolerance.h); not with constraints or
  /// fixed steps.
  bool adapt_accuracy = false;
};

/// One evaluation of psi, of its gradient and of the constraints.
struct OptimizerEvaluation {
  int index = 0;  // from 1
  std::vector<double> rho;
  double psi = 0;
  double psi_error = 0;  // as far as its run knows, of a design of one case; 0 of an evaluation that is replayed
  std::vector<double> gradient;
  std::vector<double> constraints;  // psi_c - upper, <= 0 when satisfied, in the order of Design::bounds()
  std::vector<std::vector<double>> constraint_gradients;
  /// Of a design of several cases each one's psi, as its scene has it, and its gradient by the design's parameters.
  std::vector<double> cases;
  std::vector<std::vector<double>> case_gradients;
  double projected_gradient = 0;  // largest entry of the projected gradient in scaled parameters
  Counters counters;
  double wall_s = 0;
  double rtol = 0;  // of an optimization that adapts it; 0: the problem's
  /// Of each case, where a psi or a constraint whose first value is far below the problem's absolute tolerances asked
  /// for smaller ones; or 0, or no entry: the problem's.
  std::vector<AbsoluteTolerances> tolerances;
  std::vector<std::string> warnings;  // that were given as it was made
  bool replayed = false;
  /// Made where the run ended, of its best point at the last tolerance or of the one beside it that keeps the
  /// constraints: a run that goes on does not ask for it.
  bool ending = false;
  /// Why there is no psi here (the step was rejected), or empty. psi is nan then and the lists are empty.
  std::string failure;

  bool failed() const { return !failure.empty(); }
};

struct OptimizerResult {
  std::vector<OptimizerEvaluation> evaluations;
  std::size_t best = 0;     // into evaluations: the least psi among the feasible ones
  std::string stop_reason;  // a sentence naming the criterion
  bool converged = false;   // false when a limit or a failure of the line search ended it
  /// What ended it from outside after `best` was known (an interruption, a full disk): for the caller to rethrow once
  /// the best is safe.
  std::exception_ptr error;

  std::size_t failures() const;  // how many evaluations failed
};

struct OptimizerAlgorithm {
  std::string name, summary;
  bool takes_constraints = false;
};
const std::vector<OptimizerAlgorithm>& optimizer_algorithms();

/// Why an optimization cannot adapt its tolerance, or empty.
std::string cannot_adapt(const Design& design);

/// Throws CapabilityError for an algorithm that does not exist or takes no constraints.
void require_algorithm(const std::string& algorithm, bool constrained);

/// `replay` holds the evaluations of an interrupted run, which are given back without being computed as long as the
/// optimizer asks for the same parameters bit for bit; `record` sees every evaluation as soon as it is known.
/// options.max_evaluations bounds all evaluations, failed and replayed ones included. Where the tolerance adapts, the
/// best point is evaluated anew at each change of it; the optimizer sees psi less what psi changed by there. The best
/// and its gradient are of the problem's own tolerance.
///
/// Where an evaluation fails (a motion that cannot be computed, a mechanism that locks, psi that is not finite), the
/// optimizer is shown, in its place, the parabola along the step s from the best point rho_b known until then that has
/// psi and slope p = dpsi/drho s < 0 of rho_b and rises by |p| over the whole step: psi_b + |p| with the gradient
/// 3 |p| s / |s|^2. Its least value is at a quarter of the step, which is where a line search goes next; constraints
/// rise likewise. It follows from the evaluations alone, so that a run repeats itself. The first evaluation must not
/// fail: it throws what the simulation throws, with the evaluation named.
///
/// The worst of several targets (Design::minimax) has kinks where they are equal; it is found as the least t with
/// F_g <= t for all g, smooth in (rho, t), which needs an algorithm that takes constraints. There is no gradient
/// tolerance then.
OptimizerResult optimize(const Design& design, const OptimizerOptions& options,
                         const std::vector<OptimizerEvaluation>& replay,
                         const std::function<void(const OptimizerEvaluation&)>& record);
/// Of one run alone.
OptimizerResult optimize(const Problem& problem, const std::string& method,
                         const std::vector<OptimizerConstraint>& constraints, const OptimizerOptions& options,
                         const std::vector<OptimizerEvaluation>& replay,
                         const std::function<void(const OptimizerEvaluation&)>& record);

/// The version of NLopt in use, "2.7.1".
std::string nlopt_version_text();

}  // namespace costate
