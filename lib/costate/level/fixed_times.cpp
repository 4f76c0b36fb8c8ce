#include "costate/level/fixed_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate {

namespace {

using AddTimes = void (Constraint::*)(const double*, std::vector<double>&) const;

std::vector<double> times_of(const Constraint& c, AddTimes add, const std::vector<double>& p) {
  std::vector<double> times;
  (c.*add)(p.data(), times);
  return times;
}

/// The name of a parameter that moves the time t of a constraint with the numbers p, or nothing.
std::string mover(const ParameterSelection& parameters, const Constraint& c, AddTimes add, const std::vector<double>& p,
                  double t) {
  for (const auto& parameter : parameters.parameters)
    for (const auto& [number, factor] : parameter.bindings)
      for (std::size_t k = 0; k < p.size(); ++k) {
        if (c.numbers()[k] != number) continue;
        std::vector<double> changed = p;
        changed[k] += 1e-3 * std::max(1.0, std::abs(p[k]));
        const std::vector<double> times = times_of(c, add, changed);
        if (std::find(times.begin(), times.end(), t) == times.end()) return parameter.name;
      }
  return {};
}

/// Of every driver: what `relevant` chooses among its times must not move.
template <class Relevant>
void require_fixed(const Mechanism& mechanism, const ParameterSelection& parameters, const std::vector<double>& numbers,
                   AddTimes add, const char* what, const char* instead, Relevant&& relevant) {
  for (const auto& c : mechanism.constraints()) {
    if (!c->rheonomic()) continue;
    std::vector<double> p;
    for (const int number : c->numbers()) p.push_back(numbers[static_cast<std::size_t>(number)]);
    for (const double t : times_of(*c, add, p)) {
      if (!relevant(t)) continue;
      const std::string name = mover(parameters, *c, add, p, t);
      if (!name.empty())
        throw CapabilityError(
            fmt::format("Parameter '{}' moves the time t = {:.6g} s at which the law of {} '{}' has a {}; "
                        "gradients are carried across these at fixed times only. Keep this number fixed, "
                        "take a law with a continuous {}, or the method 'differences'.",
                        name, t, c->kind(), c->name(), what, instead));
    }
  }
}

}  // namespace

std::vector<double> driver_kinks(const Mechanism& mechanism, const std::vector<double>& numbers) {
  std::vector<double> times;
  for (const auto& c : mechanism.constraints()) {
    if (!c->rheonomic()) continue;
    std::vector<double> p;
    for (const int number : c->numbers()) p.push_back(numbers[static_cast<std::size_t>(number)]);
    c->add_kinks(p.data(), times);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

void require_fixed_kink(const Mechanism& mechanism, const ParameterSelection& parameters,
                        const std::vector<double>& numbers, double t) {
  require_fixed(mechanism, parameters, numbers, &Constraint::add_kinks, "kink", "slope",
                [&](double at) { return at == t; });
}

void require_fixed_accelerations(const Mechanism& mechanism, const ParameterSelection& parameters,
                                 const std::vector<double>& numbers, double t_start, double t_end) {
  require_fixed(mechanism, parameters, numbers, &Constraint::add_acceleration_jumps, "jump of its second derivative",
                "second derivative", [&](double at) { return t_start < at && at < t_end; });
}

}  // namespace costate
