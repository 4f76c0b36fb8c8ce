// Design parameters: names for one or several of a mechanism's numbers, with bounds and scale.
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace costate {

/// number[i] = factor_i * value for every binding (number index, factor).
struct Parameter {
  std::string name;
  std::vector<std::pair<int, double>> bindings;
  double value = 0;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double scale = 1;  // typical size; the optimizer works on value / scale
};

/// The parameters that a run differentiates with respect to: rho in the equations.
struct ParameterSelection {
  std::vector<Parameter> parameters;

  int size() const { return static_cast<int>(parameters.size()); }
  std::vector<std::string> names() const;
  std::vector<double> values() const;
  /// numbers := base with the bound ones replaced by factor * rho.
  void apply(const double* rho, std::vector<double>& numbers) const;
  /// For every number the list of (column, factor); empty lists for numbers that stay fixed.
  std::vector<std::vector<std::pair<int, double>>> columns(std::size_t number_count) const;
};

}  // namespace costate
