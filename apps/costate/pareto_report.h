// What costate pareto says of a front: lines, table, summary and page.
#pragma once

#include <string>

#include "costate/optimize/pareto.h"
#include "design_setup.h"

namespace costate::app {

/// Of the point just found.
std::string point_line(const DesignSetup& whole, const Design& design, const ParetoPoint& p);
std::string pareto_text(const DesignSetup& whole, const Design& design, const ParetoFront& front, double wall_s);
/// A row for each point: what it is, its targets, the cases' psi, the parameters.
std::string pareto_csv(const DesignSetup& whole, const Design& design, const ParetoFront& front);
Json pareto_json(const DesignSetup& whole, const Design& design, const ParetoFront& front, const ParetoOptions& options,
                 double wall_s);
std::string pareto_page(const DesignSetup& whole, const Design& design, const ParetoFront& front, const Json& summary);

}  // namespace costate::app
