// The registry of formulations: a new one is one file pair that registers itself.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "costate/formulation/system.h"
#include "costate/level/formulation_options.h"

namespace costate {

struct Stabilization;    // level/acceleration_level.h
class DiscreteScheme;    // discrete/discrete_scheme.h: a fixed-step scheme with its exact tangent and adjoint
class HandEquations;     // adjoint/hand_equations.h: hand-derived tangent and adjoint equations
class HessianEquations;  // adjoint/hessian_equations.h: tangent and adjoint differentiated along directions

/// How a formulation has the constraints in its equations.
enum class ConstraintForm {
  acceleration,  // differentiated twice: M a + Phi_q^T lambda = Q, R2 = 0
  index2,        // positions and velocities, stabilised (Gear, Gupta, Leimkuhler)
  index3,        // positions
  independent,   // solved: the motion is that of independent coordinates
};

/// A formulation offers one or several forms; a gradient method works with those that it needs. What is asked about
/// formulations is asked of these members, nowhere by name.
struct Formulation {
  std::string name;
  std::string summary;  // one line for `costate list`
  ConstraintForm constraints = ConstraintForm::acceleration;
  bool carries_redundancy = false;  // rows that depend on each other
  bool weighted = false;            // a weight holds the constraints against the masses
  int adjoint_order = 1;            // 2: its hand-derived adjoint integrates mu and mu'
  /// Where a gradient's certificate or a reference needs another formulation it is looked for in this order; 0: never.
  int stand_in = 0;
  /// The integrator used when the user names none: "idas", "cvodes" or "fixed".
  std::string default_integrator;
  /// What a user may set of it.
  std::vector<FormulationOption> options = {};
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
  using MakeStabilization =
      std::function<Stabilization(const std::shared_ptr<const Mechanism>&, const FormulationOptions&)>;
  /// xi, omega and 1/alpha of the equations that a user's own adjoint is written for (candidate/candidate.h); empty:
  /// there can be none.
  MakeStabilization candidate_stabilization = {};
  using MakeFirmer =
      std::function<FormulationOptions(const std::shared_ptr<const Mechanism>&, const FormulationOptions&)>;
  /// Of constraints that hold up to O(1/alpha): the options with 10 alpha in the place of alpha. Empty where the
  /// constraints are exact.
  MakeFirmer firmer = {};
  /// Of soft constraints: whether the user has chosen how soft.
  std::function<bool(const FormulationOptions&)> softness_chosen = {};

  bool exact_constraints() const { return !firmer; }
};

/// All registered formulations by name.
const std::vector<Formulation>& formulations();
/// Throws CapabilityError with near names.
const Formulation& find_formulation(const std::string& name);
/// Those that stand in for others, in that order; with `redundant` only such as carry redundant rows.
std::vector<const Formulation*> stand_ins(bool redundant);

struct RegisterFormulation {
  explicit RegisterFormulation(Formulation f);
};
/// The fixed steps of a formulation (discrete/) and their options, which are registered apart from it.
struct RegisterDiscreteForm {
  RegisterDiscreteForm(const std::string& formulation, std::vector<FormulationOption> options,
                       Formulation::MakeDiscrete make);
};

}  // namespace costate
