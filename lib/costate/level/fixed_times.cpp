#include "costate/level/fixed_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "costate/base/error.h"
#include "costate/element/law/motion_law.h"

namespace costate {

namespace {

using AddTimes = std::function<void(const double*, std::vector<double>&)>;

std::vector<double> times_of(const AddTimes& add, const std::vector<double>& p) {
  std::vector<double> times;
  add(p.data(), times);
  return times;
}

/// The name of a parameter that moves the time t of an element with the numbers p, or nothing.
std::string mover(const ParameterSelection& parameters, const Element& e, const AddTimes& add,
                  const std::vector<double>& p, double t) {
  for (const auto& parameter : parameters.parameters)
    for (const auto& [number, factor] : parameter.bindings)
      for (std::size_t k = 0; k < p.size(); ++k) {
        if (e.numbers()[k] != number) continue;
        std::vector<double> changed = p;
        changed[k] += 1e-3 * std::max(1.0, std::abs(p[k]));
        const std::vector<double> times = times_of(add, changed);
        if (std::find(times.begin(), times.end(), t) == times.end()) return parameter.name;
      }
  return {};
}

/// Of one element: what `relevant` chooses among its times must not move.
template <class Relevant>
void require_fixed(const Element& e, const ParameterSelection& parameters, const std::vector<double>& numbers,
                   const AddTimes& add, const char* what, const char* instead, const Relevant& relevant) {
  std::vector<double> p;
  for (const int number : e.numbers()) p.push_back(numbers[static_cast<std::size_t>(number)]);
  for (const double t : times_of(add, p)) {
    if (!relevant(t)) continue;
    const std::string name = mover(parameters, e, add, p, t);
    if (!name.empty())
      throw CapabilityError(
          fmt::format("Parameter '{}' moves the time t = {:.6g} s at which the law of {} '{}' has a {}; "
                      "gradients are carried across these at fixed times only. Keep this number fixed, "
                      "take a law with a continuous {}, or the method 'differences'.",
                      name, t, e.kind(), e.name(), what, instead));
  }
}

/// Of every driver, by one of Constraint's lists of times.
template <class Relevant>
void require_fixed_driver(const Mechanism& mechanism, const ParameterSelection& parameters,
                          const std::vector<double>& numbers,
                          void (Constraint::*list)(const double*, std::vector<double>&) const, const char* what,
                          const char* instead, const Relevant& relevant) {
  for (const auto& c : mechanism.constraints())
    if (c->rheonomic())
      require_fixed(
          *c, parameters, numbers, [&](const double* p, std::vector<double>& times) { ((*c).*list)(p, times); }, what,
          instead, relevant);
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
  require_fixed_driver(mechanism, parameters, numbers, &Constraint::add_kinks, "kink", "slope",
                       [&](double at) { return at == t; });
}

void require_fixed_accelerations(const Mechanism& mechanism, const ParameterSelection& parameters,
                                 const std::vector<double>& numbers, double t_start, double t_end) {
  require_fixed_driver(mechanism, parameters, numbers, &Constraint::add_acceleration_jumps,
                       "jump of its second derivative", "second derivative",
                       [&](double at) { return t_start < at && at < t_end; });
}

void require_fixed_force_jumps(const Mechanism& mechanism, const ParameterSelection& parameters,
                               const std::vector<double>& numbers, double t_start, double t_end) {
  for (const auto& f : mechanism.forces())
    if (const auto* owner = dynamic_cast<const MotionLawElement*>(f.get()))
      require_fixed(
          *f, parameters, numbers,
          [&](const double* p, std::vector<double>& times) { owner->add_force_jumps(p, times); },
          "kink or jump under a force that holds its rate", "slope",
          [&](double at) { return t_start < at && at < t_end; });
}

}  // namespace costate
