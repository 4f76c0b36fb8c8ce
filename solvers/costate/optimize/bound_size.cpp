#include "costate/optimize/bound_size.h"

#include <algorithm>
#include <cmath>

#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {
constexpr double kOfStep = 1e-6, kKept = 1e-8, kKeptAtMost = 1e-7;
}

std::vector<double> bound_sizes(const ParameterSelection& parameters, const OptimizerEvaluation& first,
                                const std::vector<DesignBound>& bounds) {
  std::vector<double> sizes;
  for (std::size_t c = 0; c < bounds.size(); ++c) {
    const double upper = std::abs(bounds[c].upper),
                 step = c < first.constraint_gradients.size()
                            ? largest_scaled(parameters, first.constraint_gradients[c])
                            : 0;
    const double size = upper > 0 ? std::max(upper, kOfStep * step) : step;
    sizes.push_back(size > 0 && std::isfinite(size) ? size : 1);
  }
  return sizes;
}

double kept_within(double size, double upper, double rtol) {
  return std::min(kKept * std::max(1.0, std::abs(upper)), std::clamp(rtol, kKept, kKeptAtMost) * size);
}

}  // namespace costate
