#include "costate/integrator/unknown_sizes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "costate/base/power_of_ten.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {
// In lengths, or radians, a second: above, velocities are tolerated as all else.
constexpr double kSlow = 1e-3;
}  // namespace

double rate_size(const Mechanism& mechanism) {
  if (!mechanism.forces().empty()) return 1;
  for (const auto& c : mechanism.constraints())
    if (c->rheonomic()) return 1;
  const double length = length_size(mechanism);
  double largest = 0;
  for (const Number& n : mechanism.numbers()) {
    if (n.value == 0) continue;
    if (n.path.starts_with("gravity.")) return 1;
    if (n.path.ends_with("_per_s"))
      largest = std::max(largest, std::abs(n.value) / (n.path.ends_with("m_per_s") ? length : 1));
  }
  if (largest >= kSlow || largest == 0) return 1;
  return power_of_ten_above(largest);
}

bool in_forces(const std::string& unit) {
  return unit.starts_with("N") || unit.starts_with("J") || unit.starts_with("W");
}

std::vector<double> unknown_sizes(const System& system) {
  const double length = length_size(system.assembly().mechanism()), rate = rate_size(system.assembly().mechanism()),
               force = force_size(system.assembly().mechanism());
  std::vector<double> sizes;
  for (const Unknown& u : system.unknowns()) {
    const bool metric = u.unit == "m" || u.unit.starts_with("m/"), velocity = u.unit.ends_with("/s");
    sizes.push_back((metric ? length : in_forces(u.unit) ? force : 1) * (velocity ? rate : 1));
  }
  return sizes;
}

void fill_absolute_tolerances(const System& system, const SolverOptions& options, int size, double* out, double scale) {
  const auto sizes = unknown_sizes(system);
  const double atol = options.absolute() / scale;
  std::fill(out, out + size, cost_tolerance(system, options) / scale);
  for (std::size_t i = 0; i < sizes.size(); ++i) out[i] = atol * sizes[i];
}

namespace {
bool holds_forces(const std::vector<std::shared_ptr<const CostTerm>>& terms) {
  return std::any_of(terms.begin(), terms.end(), [](const auto& term) {
    const auto* of = dynamic_cast<const OutputTerm*>(&ungated(*term));
    return term->needs_accelerations() || (of && in_forces(of->output().unit()));
  });
}
}  // namespace

double cost_size(const Mechanism& mechanism, const Objective& objective) {
  const double length = length_size(mechanism), force = force_size(mechanism);
  const bool forces = force < 1 && (holds_forces(objective.running) || holds_forces(objective.terminal));
  return length * length * (forces ? force * force : 1);
}

double negligible_cost(const Mechanism& mechanism, const Objective& objective, const SolverOptions& options) {
  return 1e-4 * options.absolute() * cost_size(mechanism, objective);
}

double cost_tolerance(const System& system, const SolverOptions& options) {
  const double by_atol = options.absolute() * cost_size(system.assembly().mechanism(), system.objective()) *
                         std::min(1.0, options.t_end - options.t_start);
  return options.cost_atol > 0 ? std::min(by_atol, options.cost_atol) : by_atol;
}

}  // namespace costate
