// Gradients against each other, in the parameters' own scales.
#pragma once

#include <support/compare.h>
#include <support/differences.h>

#include <algorithm>

#include "costate/mechanism/parameter.h"

namespace costate::test {

/// The largest entry per parameter's scale.
inline double size_of(const std::vector<double>& gradient, const ParameterSelection& parameters) {
  double size = 0;
  for (std::size_t j = 0; j < gradient.size(); ++j)
    size = std::max(size, std::abs(gradient[j]) * parameters.parameters[j].scale);
  return size;
}

/// The largest difference per parameter's scale, against the gradient's size.
inline Mismatch gradient_mismatch(const std::vector<double>& a, const std::vector<double>& b,
                                  const ParameterSelection& parameters) {
  Mismatch m;
  if (a.size() != b.size() || a.size() != parameters.parameters.size()) return {HUGE_VAL, "sizes differ"};
  if (a.empty()) return {HUGE_VAL, "there are no parameters"};
  const double size = size_of(b, parameters);
  for (std::size_t j = 0; j < a.size(); ++j) {
    const double e = std::abs(a[j] - b[j]) * parameters.parameters[j].scale / size;
    if (e <= m.error) continue;
    m.error = std::isfinite(e) ? e : HUGE_VAL;
    m.text = fmt::format("{}: {:.12g} and {:.12g}, {:.2g} of the gradient", parameters.parameters[j].name, a[j], b[j],
                         m.error);
  }
  return m;
}

/// Of psi(rho), by extrapolated differences over 2e-3 of each parameter's scale.
template <class Psi>
std::vector<double> gradient_by_differences(const Psi& psi, const std::vector<double>& rho,
                                            const ParameterSelection& parameters) {
  std::vector<double> g;
  for (std::size_t j = 0; j < rho.size(); ++j) {
    const double scale = parameters.parameters[j].scale;
    const auto along = [&](double e) {
      auto x = rho;
      x[j] += e * scale;
      return psi(x);
    };
    g.push_back(directional_difference(along, 2e-3) / scale);
  }
  return g;
}

}  // namespace costate::test
