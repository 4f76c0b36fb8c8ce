// Where a search ends a little outside of its constraints and well below all that it has found inside: errors of the
// runs stand between its last steps and the constraints, and the nearest point that keeps them is as good but for
// those.
#pragma once

#include <optional>
#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

/// The parameters of the nearest point, to first order and in their scales, that keeps the constraints, from the
/// evaluation with the least violation among those that are off by little and far below `best`; nothing where there is
/// none, or no step leads there.
std::optional<std::vector<double>> nearest_kept_point(const std::vector<OptimizerEvaluation>& evaluations,
                                                      std::size_t best, const Design& design);

}  // namespace costate
