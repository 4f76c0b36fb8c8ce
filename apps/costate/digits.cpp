#include "digits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/integrators.h"

namespace costate::app {

namespace {
constexpr double kLeftByRounding = 1e-14, kBelowAllDigits = 1e-6;
}

double shown(double value, double size) { return std::abs(value) <= kLeftByRounding * size || value == 0 ? 0 : value; }

std::string known_digits(double value, double uncertainty) {
  if (value == 0 || (std::isfinite(uncertainty) && std::abs(value) < kBelowAllDigits * uncertainty)) return "0";
  if (!std::isfinite(value) || !(uncertainty > 0) || !std::isfinite(uncertainty)) return fmt::format("{:.12g}", value);
  const int first = static_cast<int>(std::floor(std::log10(std::abs(value)))),
            last = static_cast<int>(std::floor(std::log10(uncertainty) + 1e-9));
  const int digits = std::clamp(first - last + 1, 1, 15), decimals = digits - 1 - first;
  if (first < -5 || decimals < 0) return fmt::format("{:.{}e}", value, digits - 1);
  return fmt::format("{:.{}f}", value, decimals);
}

Precision precision_of(const SolverOptions& solver, const std::string& integrator, long steps) {
  Precision p;
  if (!has_fixed_steps(integrator)) {
    p.relative = solver.rtol;
    p.run = fmt::format("rtol {:g}", solver.rtol);
    p.note =
        fmt::format("no more digits than rtol {:g} can hold; --estimate-error tells how many are right", solver.rtol);
    return p;
  }
  const double span = solver.t_end - solver.t_start;
  // Of a method that makes several runs the counter is theirs together.
  if (solver.step_s > 0) steps = static_cast<long>(std::ceil(span / solver.step_s - 1e-9));
  p.run = fmt::format("{} steps of {:.6g} s", steps, span / static_cast<double>(steps));
  if (solver.step_s > 0) {
    p.note = "of these steps, exactly; --estimate-error tells how far the integral is";
  } else {
    p.relative = 0.1 * std::sqrt(solver.rtol);
    p.note =
        fmt::format("the step is chosen for an error of about {:.0e} of psi; --estimate-error measures it", p.relative);
  }
  return p;
}

double uncertainty_of(double value, double relative) {
  if (!(relative > 0) || value == 0) return 0;
  const double first = std::floor(std::log10(std::abs(value)));
  return std::pow(10, first + 1 + std::ceil(std::log10(relative) - 1e-9));
}

std::vector<double> gradient_uncertainty(const std::vector<double>& gradient, const ParameterSelection& parameters,
                                         double relative) {
  double largest = 0;
  for (std::size_t j = 0; j < gradient.size(); ++j)
    largest = std::max(largest, std::abs(gradient[j]) * parameters.parameters[j].scale);
  std::vector<double> u(gradient.size(), 0.0);
  for (std::size_t j = 0; j < gradient.size(); ++j)
    u[j] = uncertainty_of(largest / parameters.parameters[j].scale, relative);
  return u;
}

std::optional<double> psi_error_of(std::optional<double> estimate, const std::optional<KnownError>& known) {
  // Whoever knows of the gradient alone knows nothing of psi.
  if (!known || known->psi == 0 || !(known->all || estimate)) return estimate;
  return std::max(estimate.value_or(0), known->psi);
}

std::vector<double> gradient_error_of(std::vector<double> errors, const std::optional<KnownError>& known) {
  if (!known || !(known->all || !errors.empty())) return errors;
  errors.resize(std::max(errors.size(), known->gradient.size()), 0.0);
  for (std::size_t j = 0; j < known->gradient.size(); ++j) errors[j] = std::max(errors[j], known->gradient[j]);
  return errors;
}

GradientDigits gradient_digits(const std::vector<double>& gradient, const ParameterSelection& parameters,
                               double relative, const std::vector<double>& errors,
                               const std::optional<KnownError>& known) {
  GradientDigits d;
  d.errors = gradient_error_of(errors, known);
  d.unknown = known && errors.empty() ? known->gradient : d.errors;
  if (!errors.empty()) return d;
  const std::vector<double> held = gradient_uncertainty(gradient, parameters, relative);
  bool beyond = false;
  // Also where not even the digit that is shown is one.
  for (std::size_t j = 0; j < d.errors.size(); ++j)
    beyond = beyond || d.errors[j] > held[j] || d.errors[j] > std::abs(gradient[j]);
  if (!beyond) d.errors.clear();
  d.unknown.resize(held.size(), 0.0);
  for (std::size_t j = 0; j < held.size(); ++j) d.unknown[j] = std::max(d.unknown[j], held[j]);
  return d;
}

std::string psi_text(double psi, const Precision& precision, std::optional<double> estimate,
                     const std::optional<KnownError>& known) {
  if (estimate || (known && known->psi > uncertainty_of(psi, precision.relative)))
    estimate = psi_error_of(estimate, known);
  if (estimate) return fmt::format("psi = {} (estimated error {:.1e})", known_digits(psi, *estimate), *estimate);
  const std::string shown = fmt::format(
      "psi = {}", known_digits(psi, std::max(uncertainty_of(psi, precision.relative), known ? known->psi : 0)));
  return precision.note.empty() ? shown : fmt::format("{} ({})", shown, precision.note);
}

}  // namespace costate::app
