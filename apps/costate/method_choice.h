// What goes with a formulation that was chosen alone.
#pragma once

#include <string>

#include "costate/integrator/integrators.h"
#include "costate/sensitivity/method.h"

namespace costate::app {

/// Whether a formulation runs on an integrator; on its default in any case.
inline bool carries(const Formulation& f, const std::string& integrator) {
  return !is_integrator(integrator) || find_integrator(integrator).carries(f);
}

/// The method, or, where it does not go with the formulation, one that does.
inline std::string method_for(const Formulation& f, const std::string& method) {
  const SensitivityMethod& wanted = find_sensitivity_method(method);
  if (refusal(wanted, f).empty()) return method;
  // Of those that go with it one of the same kind, where there is one.
  const auto fits = [&](const SensitivityMethod& m) { return !m.perturbs && refusal(m, f).empty(); };
  const SensitivityMethod* other =
      first_method([&](const SensitivityMethod& m) { return fits(m) && m.adjoint == wanted.adjoint; });
  if (other == nullptr) other = first_method(fits);
  return other != nullptr ? other->name : method;
}

}  // namespace costate::app
