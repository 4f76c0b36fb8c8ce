// The registry of gradient methods: a new one is one file that registers itself.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

struct SensitivityMethod {
  std::string name;     // "idas-adjoint"
  std::string summary;  // one line for `costate list`
  enum class Needs { dae, ode, either, discrete, hand_tangent, hand_adjoint } needs = Needs::either;
  std::function<GradientResult(const Problem&, const std::vector<double>& rho)> gradient;
};

const std::vector<SensitivityMethod>& sensitivity_methods();
const SensitivityMethod& find_sensitivity_method(const std::string& name);

/// Empty when the method works with the formulation; otherwise why not, and the nearest combination that does.
std::string refusal(const SensitivityMethod& method, const Formulation& formulation);

/// psi and its gradient; throws CapabilityError for a combination that does not exist.
GradientResult gradient(const Problem& problem, const std::string& method, const std::vector<double>& rho);

/// |gradient at rtol - gradient at rtol/10| per parameter, by a tighter rerun.
std::vector<double> estimate_gradient_error(const Problem& problem, const std::string& method,
                                            const std::vector<double>& rho, const GradientResult& result);

struct RegisterSensitivityMethod {
  explicit RegisterSensitivityMethod(SensitivityMethod m);
};

}  // namespace costate
