// All registered formulations, with the settings that exercise all of their terms.
#pragma once

#include <string>
#include <vector>

#include "costate/formulation/formulation.h"
#include "costate/sensitivity/method.h"

namespace costate::test {

struct Variant {
  std::string formulation, label;
  FormulationOptions options;
};

/// Every registered formulation as it comes; the penalty formulation also with so small a weight that the 1/alpha
/// block counts (and not so small that the constraints are lost).
inline std::vector<Variant> variants(int soft_weight = 30) {
  std::vector<Variant> r;
  for (const auto& f : formulations()) {
    r.push_back({f.name, f.name, {}});
    if (f.exact_constraints() || f.adjoint_order != 1) continue;
    Variant soft{f.name, f.name + ", alpha = " + std::to_string(soft_weight), {}};
    soft.options.set("penalty_alpha", soft_weight);
    r.push_back(soft);
  }
  return r;
}

/// Names of the registered gradient methods by an integrator of tolerance rtol that a formulation can be run with
/// (those on its residual or its right-hand side; not the difference oracle).
inline std::vector<std::string> integrator_methods(const std::string& formulation) {
  using Needs = SensitivityMethod::Needs;
  std::vector<std::string> r;
  for (const auto& m : sensitivity_methods())
    if ((m.needs == Needs::dae || m.needs == Needs::ode) && refusal(m, find_formulation(formulation)).empty())
      r.push_back(m.name);
  return r;
}

}  // namespace costate::test
