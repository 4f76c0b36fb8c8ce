// The page of a study: what its runs achieved, and of each design how its points lie: dots over each number that was
// varied, parallel coordinates, the front between the quantities that [[design]] pareto names.
#pragma once

#include <string>

#include "costate/json_text.h"

namespace costate::app {

/// `rows` are those of study.json, with `pareto` by design as pareto_of_designs() has it; `text` is study.txt.
std::string study_page(const std::string& title, const Json& rows, const Json& pareto, const std::string& text);

/// By design the quantities that are to be small (`quantities`) and the runs that no other one beats in all (`front`).
Json pareto_of_designs(const Json& rows);

}  // namespace costate::app
