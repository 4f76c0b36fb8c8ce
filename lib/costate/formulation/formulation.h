// The registry of formulations: a new one is one file pair that registers itself.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "costate/formulation/system.h"

namespace costate {

/// Settings that formulations read; unset means the formulation's own default.
struct FormulationOptions {
  double baumgarte_xi = 1;                 // damping ratio of the constraint error
  double baumgarte_omega_rad_per_s = 10;   // its frequency
  double penalty_xi = 1;
  double penalty_omega_rad_per_s = 10;
  double penalty_alpha = 0;  // weight of the constraints against the masses; 0: 1e8 times the largest mass entry
  std::string discrete_scheme = "newmark";  // fixed-step runs: "newmark" (trapezoidal) or "generalized-alpha"
  double discrete_rho_infinity = 0.8;       // generalized-alpha: what a step leaves of the fastest oscillations
};

class DiscreteScheme;  // discrete/discrete_scheme.h: a fixed-step scheme with its exact tangent and adjoint
class HandEquations;   // adjoint/hand_equations.h: hand-derived tangent and adjoint equations
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

}  // namespace costate
