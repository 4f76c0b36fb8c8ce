#include "costate/integrator/adjoint_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/integrator/unknown_sizes.h"

namespace costate {

namespace {
// g_y is looked at after so many evaluations, and where g has changed by this factor, unless it is as small a part as
// that of the largest.
constexpr long kSampled = 8;
constexpr double kAnother = 4, kSmall = 1e-2;
// Positions that are less are rounding, and no measure of anything.
constexpr double kLeastPosition = 1e-6;
}  // namespace

bool AdjointScale::is_due(double t, double g) {
  g = std::abs(g);
  if (std::isnan(t_)) {
    t_ = first_ = t;
    cost_at_first_ = g;
  } else if (t <= t_) {  // in the place of the last attempt
    t_ -= step_;
    gradient_ = gradient_before_;
    cost_ = cost_before_;
  }
  step_ = std::max(0.0, t - t_);
  t_ += step_;
  gradient_before_ = gradient_;
  cost_before_ = cost_;
  cost_ += g * step_;
  gradient_ += sampled_gradient_ * step_;
  largest_cost_ = std::max(largest_cost_, g);
  const double larger = std::max(g, sampled_cost_), smaller = std::min(g, sampled_cost_);
  const bool due = evaluations_++ % kSampled == 0 || (larger > kAnother * smaller && larger > kSmall * largest_cost_);
  if (due) sampled_cost_ = g;
  return due;
}

void AdjointScale::sample(const double* y, const std::vector<double>& g_y, const std::vector<Unknown>& unknowns) {
  double largest = 0;
  for (std::size_t i = 0; i < g_y.size(); ++i) {
    largest = std::max(largest, std::abs(g_y[i]) * (in_forces(unknowns[i].unit) ? force_ : 1));
    if (unknowns[i].role == Unknown::Role::position) position_ = std::max(position_, std::abs(y[i]));
    if (unknowns[i].role == Unknown::Role::velocity) velocity_ = std::max(velocity_, std::abs(y[i]));
  }
  gradient_ += (largest - sampled_gradient_) * step_;
  sampled_gradient_ = largest;
  if (samples_++ == 0) at_first_ = largest;
}

void AdjointScale::add_segment(const AdjointScale& other, double span) {
  integral_ += other.size(span).all;
  value_ += other.t_ > other.first_ ? other.cost_ * (span / (other.t_ - other.first_)) : other.cost_at_first_ * span;
  position_ = std::max(position_, other.position_);
  velocity_ = std::max(velocity_, other.velocity_);
}

AdjointSize AdjointScale::size() const {
  // Without a scale of time nothing is known of velocities; a slow motion's are not given more room than the rest.
  return {integral_, velocity_ > position_ && position_ > 0 ? position_ / velocity_ : 1,
          position_ > 0 ? value_ / std::max(position_, kLeastPosition) : 0};
}

AdjointSize AdjointScale::with_terminal(double cost, const double* y, const std::vector<Unknown>& unknowns) const {
  AdjointSize s = size();
  double position = position_;
  for (std::size_t i = 0; i < unknowns.size(); ++i)
    if (unknowns[i].role == Unknown::Role::position) position = std::max(position, std::abs(y[i]));
  s.cost = value_ + std::abs(cost);
  s.value = position > 0 ? s.cost / std::max(position, kLeastPosition) : 0;
  return s;
}

AdjointSize AdjointScale::size(double span) const {
  AdjointSize s = size();
  s.all = t_ > first_ ? gradient_ * (span / (t_ - first_)) : at_first_ * span;
  return s;
}

namespace {
// What evaluations leave of their digits.
constexpr double kOfEvaluations = 100 * std::numeric_limits<double>::epsilon();
// Masses [kg, kg m^2] that are smaller are light.
constexpr double kLight = 1e-4;
}  // namespace

double rounding_of_cost_gradient(System& system, const double* y, double atol,
                                 const std::function<void(const double* y, double* g_y)>& gradient) {
  if (!system.has_running_cost()) return 0;
  const auto n = static_cast<std::size_t>(system.size());
  std::vector<double> x(y, y + n), g_y(n), g_y_rounded(n);
  const std::vector<double> sizes = unknown_sizes(system);
  gradient(y, g_y.data());
  for (std::size_t i = 0; i < n; ++i) {
    const Unknown& u = system.unknowns()[i];
    const double size = std::abs(y[i]);
    // No two of them alike: a cost may see nothing of a motion as a whole.
    const double part = std::sin(1.0 + 2.3 * static_cast<double>(i));
    x[i] += part * (u.differential ? kOfEvaluations * size : std::min(size, atol * sizes[i]));
  }
  gradient(x.data(), g_y_rounded.data());
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i)
    largest =
        std::max(largest, std::abs(g_y_rounded[i] - g_y[i]) * (in_forces(system.unknowns()[i].unit) ? sizes[i] : 1));
  return largest;
}

namespace {
/// AdjointUnits::lightness.
std::vector<double> find_lightness(const System& system) {
  const Assembly& assembly = system.assembly();
  const auto& unknowns = system.unknowns();
  std::vector<double> lightness(unknowns.size(), 1);
  const auto is_acceleration = [](const Unknown& u) { return u.role == Unknown::Role::acceleration; };
  // Independent ones are few, and have masses of their own.
  if (std::count_if(unknowns.begin(), unknowns.end(), is_acceleration) != assembly.n()) return lightness;
  const SparsePattern& at = assembly.square();
  std::size_t j = 0;  // the coordinate
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    if (!is_acceleration(unknowns[i])) continue;
    for (auto k = static_cast<std::size_t>(at.column_start[j]); k < static_cast<std::size_t>(at.column_start[j + 1]);
         ++k)
      if (at.row[k] == static_cast<int>(j) && assembly.M[k] > 0) lightness[i] = std::max(1.0, kLight / assembly.M[k]);
    ++j;
  }
  return lightness;
}
}  // namespace

AdjointUnits::AdjointUnits(const System& system) {
  const auto& unknowns = system.unknowns();
  const double length = length_size(system.assembly().mechanism());
  least_position = kLeastPosition * length;
  const bool lengths = std::any_of(unknowns.begin(), unknowns.end(), [](const Unknown& u) { return u.unit == "m"; });
  lightness = find_lightness(system);
  for (const Unknown& u : unknowns)
    levers.push_back(lengths && (u.unit.starts_with("rad") || u.unit.starts_with("1")) ? length : 1);
}

double set_adjoint_tolerances(const std::vector<Unknown>& unknowns, const AdjointUnits& units,
                              const std::vector<double>& mu, const AdjointSize& expected, double rtol,
                              double unweighted, double* atol) {
  const std::vector<double>& levers = units.levers;
  double others = expected.all, velocities = expected.all * expected.velocity_factor;
  for (std::size_t i = 0; i < mu.size(); ++i) {
    if (!unknowns[i].differential) continue;
    double& size = unknowns[i].role == Unknown::Role::velocity ? velocities : others;
    size = std::max(size, std::abs(mu[i]) / levers[i]);
  }
  // An adjoint that is zero by its equations, a cost whose gradient is normal to the constraints for one, is what
  // rounding leaves: it is noise, and no step would be short enough to follow it.
  others = std::max({others, kOfEvaluations / rtol * expected.value, expected.least / rtol});
  // Each grows out of the other within the motion's time, so that neither is measured by its own rounding alone.
  const double factor = std::min(expected.velocity_factor, 1.0);
  others = std::max(others, velocities);
  velocities = std::max(velocities, others * factor);
  if (!(others > 0)) others = velocities = 1;
  for (std::size_t i = 0; i < mu.size(); ++i)
    atol[i] = !unknowns[i].in_norm ? unweighted
                                   : levers[i] * units.lightness[i] * rtol *
                                         (unknowns[i].role == Unknown::Role::velocity ? velocities : others);
  return std::max(others, velocities);
}

void set_gradient_tolerances(const System& system, const AdjointUnits& units, const double* y, double adjoint_size,
                             double cost, double rtol, double* atol) {
  double size = 0;  // of the positions
  bool any = false;
  for (int i = 0; i < system.size(); ++i)
    if (system.unknowns()[i].role == Unknown::Role::position) {
      size = std::max(size, units.levers[static_cast<std::size_t>(i)] * std::abs(y[i]));
      any = true;
    }
  const double of_psi = !any && cost > 0 ? cost : adjoint_size * std::max(size, units.least_position);
  for (int j = 0; j < system.parameter_count(); ++j) atol[j] = rtol * of_psi / system.parameters().parameters[j].scale;
}

}  // namespace costate
