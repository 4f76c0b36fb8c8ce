// The registry of gradient methods: a new one is one file that registers itself.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

struct SensitivityMethod {
  std::string name;     // by this it is chosen: cvodes-forward, say
  std::string summary;  // one line for `costate list`
  enum class Needs { dae, ode, either, discrete, hand_tangent, hand_adjoint } needs = Needs::either;
  std::function<GradientResult(const Problem&, const std::vector<double>& rho)> gradient;
  // What is asked about methods is asked of these, nowhere by name.
  bool adjoint = false;            // runs back
  bool keeps_checkpoints = false;  // of the run forward
  bool perturbs = false;           // uses no derivative code
  bool is_reference = false;       // what 'costate check' measures the others by
};

const std::vector<SensitivityMethod>& sensitivity_methods();
const SensitivityMethod& find_sensitivity_method(const std::string& name);

/// The first by name of which `of` holds, or null.
const SensitivityMethod* first_method(const std::function<bool(const SensitivityMethod&)>& of);

/// Empty when the method works with the formulation; otherwise why not, and the nearest combination that does.
std::string refusal(const SensitivityMethod& method, const Formulation& formulation);

/// What a method's forward run is integrated by.
std::string integrator_of(const Problem& problem, const SensitivityMethod& method);
/// Those on which it can run with a formulation; empty where it is no integrator's own method.
std::vector<std::string> integrators_of(const SensitivityMethod& method, const Formulation& formulation);
/// Whether its steps are of a given length: then rtol says little about its error.
bool by_fixed_steps(const Problem& problem, const SensitivityMethod& method);

/// psi and its gradient; throws CapabilityError for a combination that does not exist.
GradientResult gradient(const Problem& problem, const std::string& method, const std::vector<double>& rho);

/// |gradient at rtol - gradient at rtol/10| per parameter, by a tighter rerun.
std::vector<double> estimate_gradient_error(const Problem& problem, const std::string& method,
                                            const std::vector<double>& rho, const GradientResult& result);

struct RegisterSensitivityMethod {
  explicit RegisterSensitivityMethod(SensitivityMethod m);
};

}  // namespace costate
