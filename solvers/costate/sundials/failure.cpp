#include "costate/sundials/failure.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/analysis/complaints.h"
#include "costate/base/error.h"

namespace costate {

namespace {

/// The three largest |weights * x| by name: "P.x (3.1e+02 x tolerance), ..."; empty when all are zero.
std::string largest(const double* weights, const double* x, const std::vector<Unknown>& unknowns, const char* unit) {
  if (!weights || !x) return {};
  std::vector<std::pair<double, std::string>> found;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const double e = std::abs(weights[i] * x[i]);
    if (e > 0 || !std::isfinite(e)) found.emplace_back(std::isfinite(e) ? e : HUGE_VAL, unknowns[i].name);
  }
  std::sort(found.rbegin(), found.rend());
  found.resize(std::min<std::size_t>(3, found.size()));
  std::vector<std::string> names;
  for (const auto& [e, name] : found) names.push_back(fmt::format("{} ({:.2g} x tolerance{})", name, e, unit));
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

namespace {
/// SUNDIALS' own words, but for those that do not say what is wrong.
std::string cause(const FailureContext& c) {
  for (const char* words : {"tstop", "EwtSet", "error weight", "ewt"})
    if (c.message.find(words) != std::string::npos)
      return "No step can be made from there: unknowns or their rates are so large that they overflow.";
  if (c.message.find("too close to t0") != std::string::npos)
    return "The run is too short: between its times there are not enough numbers for a step.";
  return c.message;
}
}  // namespace

std::vector<Unknown> adjoint_names(std::vector<Unknown> unknowns) {
  for (Unknown& u : unknowns) u.name = "adjoint of " + u.name;
  return unknowns;
}

std::string elements_at(System& system, double t, const double* y) {
  if (!y) return {};
  try {
    return element_complaints(system.assembly(), system.look_state(t, y));
  } catch (const Error&) {
    return {};  // of positions that are not found no element says anything
  }
}

std::string elements_at(System& system, std::initializer_list<double> times,
                        const std::function<const double*(double t)>& state) {
  for (const double t : times)
    if (std::string said = elements_at(system, t, state(t)); !said.empty()) return said;
  return {};
}

std::string pace_message(double all, long most) {
  return fmt::format(
      "hardly gets on: at the pace of its last steps the run would take about {:.2g} of them, more than "
      "the limit of {} (max_steps), and stopped",
      all, most);
}

std::string failure_report(const FailureContext& c, const std::vector<Unknown>& unknowns) {
  std::string text =
      fmt::format("{} at t = {:.9g} s after {} steps, step size {:.3g} s [{}].", c.what, c.t, c.steps, c.step, c.flag);
  const std::string errors = largest(c.weights, c.errors, unknowns, "");
  const std::string rates = errors.empty() ? largest(c.weights, c.rates, unknowns, " per second") : "";
  if (!errors.empty()) text += fmt::format(" Largest local errors: {}.", errors);
  if (!rates.empty()) text += fmt::format(" Fastest changes: {}.", rates);
  if (!c.message.empty()) text += " " + cause(c);
  if (!c.elements.empty()) text += " " + c.elements;
  text +=
      " Check the scene near this time (singular configuration, coinciding points, very stiff elements, very light "
      "masses), "
      "loosen rtol, or try another formulation.";
  return text;
}

}  // namespace costate
