#include "costate/optimize/optimizer_unit.h"

#include <algorithm>
#include <cmath>

#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {
double unit_of(const ParameterSelection& parameters, double value, const std::vector<double>& gradient) {
  constexpr double far = 1e3;
  const double size = std::max(std::abs(value), largest_scaled(parameters, gradient));
  if (!(size > 0) || !std::isfinite(size) || (size <= far && size >= 1 / far)) return 1;
  return std::pow(10, std::round(std::log10(size)));
}
}  // namespace

OptimizerUnits optimizer_units(const ParameterSelection& parameters, const OptimizerEvaluation& first,
                               const std::vector<DesignBound>& bounds) {
  OptimizerUnits units;
  units.psi = unit_of(parameters, first.psi, first.gradient);
  for (std::size_t c = 0; c < bounds.size(); ++c)
    units.constraints.push_back(unit_of(parameters, std::max(std::abs(first.constraints[c]), std::abs(bounds[c].upper)),
                                        first.constraint_gradients[c]));
  return units;
}

}  // namespace costate
