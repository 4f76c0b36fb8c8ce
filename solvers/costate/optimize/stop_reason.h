// Why a search ended, in words, and whether what it found is where it ended.
#pragma once

#include <nlopt.hpp>
#include <string>

#include "costate/optimize/optimizer.h"

namespace costate {

/// Psi fell to the stop value.
std::string low_enough(const OptimizerOptions& options);

/// What NLopt says of its end; empty where that is no criterion of its own.
std::string reason_of(nlopt::result result, const OptimizerOptions& options);

/// That the optimizer's conditions hold at the best point, of a search with constraints or without.
std::string conditions_hold(const OptimizerEvaluation& best, bool constrained);

/// That a search came to nothing but points that could not be evaluated, the last of which is this.
std::string no_step_evaluated(const OptimizerEvaluation& last);

/// Whether a search that its optimizer calls converged ended at a point worse than the best one that it met: what holds
/// there does not hold of the best.
bool ended_elsewhere(const std::vector<OptimizerEvaluation>& evaluations, std::size_t best);

}  // namespace costate
