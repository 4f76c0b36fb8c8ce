#include "costate/problem/known_error.h"

#include <algorithm>
#include <cmath>

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

}  // namespace costate
