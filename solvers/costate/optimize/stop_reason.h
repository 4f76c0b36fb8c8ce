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

/// Whether a search that its optimizer calls converged ended at a point worse than the best one that it met: what holds
/// there does not hold of the best.
bool ended_elsewhere(const std::vector<OptimizerEvaluation>& evaluations, std::size_t best);

}  // namespace costate
