// Formulas in [force.NAME], [couple.NAME] and [actuator.NAME]: forces, torques and commands that depend on positions
// and velocities.
#pragma once

#include <string>
#include <vector>

#include "costate/kind/force/actuator.h"
#include "costate/kind/law/formula_keys.h"

namespace costate {

/// The torque [N m] on angles as add_couple's, a formula of t, `keys` and coordinates, points and their rates
/// ("crank.angle", "P.x_dot").
void add_formula_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                        const std::string& torque_N_m, const FormulaKeys& keys, bool with_work = false);

/// Components [N] of the force on a point, along the ground's axes; an empty formula is zero.
void add_formula_force(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const std::vector<std::string>& components_N, const FormulaKeys& keys, bool with_work = false);

/// As add_actuator and add_rotary_actuator, whose command is left empty: a formula in its place [N, N m].
void add_formula_actuator(MechanismBuilder& builder, const std::string& name, const std::string& from,
                          const std::string& to, const ActuatorOptions& options, const std::string& command_N,
                          const FormulaKeys& keys);
void add_formula_rotary_actuator(MechanismBuilder& builder, const std::string& name,
                                 const std::vector<std::string>& angles, const RotaryActuatorOptions& options,
                                 const std::string& command_N_m, const FormulaKeys& keys);

}  // namespace costate
