#include "costate/problem/known_error.h"

#include <algorithm>
#include <cmath>

#include "costate/problem/scaled_gradient.h"

namespace costate {

void widen_error(Simulation& result, double psi) {
  if (!result.known_error) result.known_error.emplace();
  result.known_error->psi = std::max(result.known_error->psi, std::abs(psi));
}

void widen_error(GradientResult& result, double psi, const std::vector<double>& gradient) {
  widen_error(result, psi);
  std::vector<double>& known = result.known_error->gradient;
  known.resize(result.gradient.size(), 0.0);
  for (std::size_t j = 0; j < known.size() && j < gradient.size(); ++j)
    known[j] = std::max(known[j], std::abs(gradient[j]));
}

void widen_error(GradientResult& result, const ParameterSelection& parameters, double psi, double scaled) {
  std::vector<double> gradient;
  for (std::size_t j = 0; j < result.gradient.size(); ++j) gradient.push_back(scaled / parameters.parameters[j].scale);
  widen_error(result, psi, gradient);
}

void widen_by_what_stays(Simulation& result, double part) {
  widen_error(result, part * result.psi);
  result.known_error->stays = std::max(result.known_error->stays, part);
}

double what_stays(const Simulation& result) { return result.known_error ? result.known_error->stays : 0; }

void widen_by_drift(GradientResult& result, const ParameterSelection& parameters, double drift) {
  const double size = gradient_size(parameters, result.psi, result.gradient);
  for (const double part : {drift, what_stays(result)})
    if (part > 0) widen_error(result, parameters, part * result.psi, part * size);
}

std::vector<double> pooled_changes(const ParameterSelection& parameters, const std::vector<double>& a,
                                   const std::vector<double>& b) {
  constexpr double kOfLargest = 0.1;
  const double largest = largest_scaled_change(parameters, a, b);
  std::vector<double> changes;
  for (std::size_t j = 0; j < b.size(); ++j)
    changes.push_back(std::max(std::abs(a[j] - b[j]), kOfLargest * largest / parameters.parameters[j].scale));
  return changes;
}

}  // namespace costate
