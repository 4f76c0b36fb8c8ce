// Formulas in [force.NAME] and [couple.NAME]: forces and torques that depend on positions and velocities.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/mechanism/builder.h"

namespace costate {

using FormulaNumbers = std::vector<std::pair<std::string, double>>;

/// The torque [N m] on angles as add_couple's, a formula of t, `numbers` and coordinates, points and their rates
/// ("crank.angle", "P.x_dot").
void add_formula_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                        const std::string& torque_N_m, const FormulaNumbers& numbers, bool with_work = false);

/// Components [N] of the force on a point, along the ground's axes; an empty formula is zero.
void add_formula_force(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const std::vector<std::string>& components_N, const FormulaNumbers& numbers,
                       bool with_work = false);

}  // namespace costate
