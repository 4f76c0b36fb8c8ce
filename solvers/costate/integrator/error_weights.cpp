#include "costate/integrator/error_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace costate {

namespace {
// The differentiation formulas' coefficients, up to 10 in sum, and as much for the solution of the equations of motion.
constexpr double kRounding = 100 * std::numeric_limits<double>::epsilon();
// A first step is as small as it must be, and its accelerations are those that it starts with: relative to the largest.
constexpr double kFirstStep = 1e-6;
}  // namespace

int set_error_weights(const std::vector<Unknown>& unknowns, const double* y, double rtol, const double* atol, double h,
                      double* weights) {
  using Role = Unknown::Role;
  double velocity = 0, acceleration = 0, multiplier = 0;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const double size = std::abs(y[i]);
    if (unknowns[i].role == Role::velocity) velocity = std::max(velocity, size);
    if (unknowns[i].role == Role::acceleration) acceleration = std::max(acceleration, size);
    if (unknowns[i].role == Role::multiplier) multiplier = std::max(multiplier, size);
  }
  const double noise = h != 0 ? kRounding * velocity / std::abs(h) : kFirstStep * acceleration;
  const double of_multipliers = acceleration > 0 ? noise * multiplier / acceleration : 0;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    double error = rtol * std::abs(y[i]) + atol[i];
    if (unknowns[i].role == Role::acceleration) error = std::max(error, noise);
    if (unknowns[i].role == Role::multiplier) error = std::max(error, of_multipliers);
    if (!(error > 0)) return -1;
    weights[i] = 1 / error;
  }
  return 0;
}

}  // namespace costate
