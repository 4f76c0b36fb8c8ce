// One search by NLopt, behind optimize().
#pragma once

#include <optional>

#include "costate/optimize/optimizer.h"

namespace costate {

/// Of a design whose fixed steps have been chosen.
OptimizerResult run_optimizer(const Design& design, const OptimizerOptions& options,
                              const std::vector<OptimizerEvaluation>& replay,
                              const std::function<void(const OptimizerEvaluation&)>& record);

/// The best of the first `count` evaluations, of those at the tightest tolerance: the least violation of the
/// constraints, in parts of their sizes (optimize/bound_size.h), then the least psi.
std::optional<std::size_t> best_evaluation(const std::vector<OptimizerEvaluation>& evaluations, std::size_t count,
                                           const Design& design);

/// What an error says.
std::string message_of(const std::exception_ptr& error);

}  // namespace costate
