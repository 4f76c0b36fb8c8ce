#include "costate/mechanism/parameter.h"

namespace costate {

std::vector<std::string> ParameterSelection::names() const {
  std::vector<std::string> r;
  for (const auto& p : parameters) r.push_back(p.name);
  return r;
}

std::vector<double> ParameterSelection::values() const {
  std::vector<double> r;
  for (const auto& p : parameters) r.push_back(p.value);
  return r;
}

void ParameterSelection::apply(const double* rho, std::vector<double>& numbers) const {
  for (std::size_t j = 0; j < parameters.size(); ++j)
    for (const auto& [number, factor] : parameters[j].bindings) numbers[number] = factor * rho[j];
}

std::vector<std::vector<std::pair<int, double>>> ParameterSelection::columns(std::size_t number_count) const {
  std::vector<std::vector<std::pair<int, double>>> r(number_count);
  for (std::size_t j = 0; j < parameters.size(); ++j)
    for (const auto& [number, factor] : parameters[j].bindings) r[number].emplace_back(static_cast<int>(j), factor);
  return r;
}

}  // namespace costate
