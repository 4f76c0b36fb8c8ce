#include "costate/sundials/finite_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/analysis/not_finite.h"
#include "costate/base/error.h"
#include "costate/sundials/callback_guard.h"

namespace costate {

namespace {
/// A sum of zeros, unless an entry is no number.
bool all_finite(const double* x, int count) {
  double sum = 0;
  for (int i = 0; i < count; ++i) sum += 0 * x[i];
  return sum == 0;
}
}  // namespace

void require_trial_state(const System& system, double t, const double* y) {
  if (!all_finite(y, system.size()))
    throw NoNumber(fmt::format("A trial step to t = {:.9g} s led to a state that is no number.", t));
}

void require_values(System& system, double t, const double* y, const double* values) {
  if (all_finite(values, system.size())) return;
  const StateView s = system.kinematic_state(t, y);
  system.assembly().calc_dynamics(s);
  require_finite(system.assembly(), s);
  throw NoNumber(fmt::format("The equations of motion give no number at t = {:.9g} s.", t));
}

double not_finite_reach(double span, double step) { return std::max(1e-6 * std::abs(span), 100 * std::abs(step)); }

}  // namespace costate
