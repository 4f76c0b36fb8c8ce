// The registry of formulations: a new one is one file pair that registers itself.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "costate/formulation/system.h"
#include "costate/level/formulation_options.h"

namespace costate {

class DiscreteScheme;    // discrete/discrete_scheme.h: a fixed-step scheme with its exact tangent and adjoint
class HandEquations;     // adjoint/hand_equations.h: hand-derived tangent and adjoint equations
class HessianEquations;  // adjoint/hessian_equations.h: tangent and adjoint differentiated along directions

/// A formulation offers one or several forms; a gradient method works with those that it needs.
struct Formulation {
  std::string name;
  std::string summary;  // one line for `costate list`
  bool carries_redundancy = false;
  /// The integrator used when the user names none: "idas", "cvodes" or "fixed".
  std::string default_integrator;
  using MakeDae = std::function<std::unique_ptr<DaeSystem>(std::shared_ptr<const Mechanism>, ParameterSelection,
                                                           Objective, const FormulationOptions&)>;
  using MakeOde = std::function<std::unique_ptr<OdeSystem>(std::shared_ptr<const Mechanism>, ParameterSelection,
                                                           Objective, const FormulationOptions&)>;
  using MakeDiscrete = std::function<std::unique_ptr<DiscreteScheme>(
      std::shared_ptr<const Mechanism>, ParameterSelection, Objective, const FormulationOptions&)>;
  using MakeHand = std::function<std::unique_ptr<HandEquations>(std::shared_ptr<const Mechanism>, ParameterSelection,
                                                                Objective, const FormulationOptions&)>;
  using MakeHessian = std::function<std::unique_ptr<HessianEquations>(
      std::shared_ptr<const Mechanism>, ParameterSelection, Objective, const FormulationOptions&)>;
  // Each is empty when the formulation has no such form.
  MakeDae make_dae = {};
  MakeOde make_ode = {};
  MakeDiscrete make_discrete = {};
  MakeHand make_hand_tangent = {};
  MakeHand make_hand_adjoint = {};
  MakeHessian make_hessian = {};
};

/// All registered formulations by name.
const std::vector<Formulation>& formulations();
/// Throws CapabilityError with near names.
const Formulation& find_formulation(const std::string& name);

struct RegisterFormulation {
  explicit RegisterFormulation(Formulation f);
};
/// The fixed steps of a formulation (discrete/), which are registered apart from it.
struct RegisterDiscreteForm {
  RegisterDiscreteForm(const std::string& formulation, Formulation::MakeDiscrete make);
};

}  // namespace costate
