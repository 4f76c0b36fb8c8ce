// An evaluation of an optimization, in the summary and as the line that shows it.
#pragma once

#include <string>
#include <vector>

#include "costate/optimize/adapted_tolerance.h"
#include "json_text.h"

namespace costate::app {

Json evaluation_json(const OptimizerEvaluation& e, const std::vector<std::string>& names,
                     const std::vector<DesignBound>& bounds);

/// `relative`: what is known of psi (digits.h).
std::string evaluation_line(const OptimizerEvaluation& e, const std::vector<std::string>& names, double relative,
                            bool verbose);

/// What an optimization that adapts its tolerance took, and in a line.
Json adaptation_json(const Adaptation& adaptation);
std::string adaptation_text(const Json& adaptation);

}  // namespace costate::app
