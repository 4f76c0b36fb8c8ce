// Parameters that redundant constraints do not let move: of three parallel links that carry a plate one alone cannot
// become longer. Derivatives by such a parameter do not exist; by least squares each formulation would print one.
#pragma once

#include <Eigen/Core>
#include <utility>

#include "costate/assembly/assembly.h"

namespace costate {

/// At the start of the assembly's parameters at time t, and where rows are redundant there at positions beside it and
/// where the drivers lead until t_end: a parameter may move no row just where the mechanism stands (a gear's ratio at
/// the angle zero). Throws ModelError naming the parameter and the row that would be torn most.
void require_compatible_parameters(Assembly& assembly, double t, double t_end);

/// The error of the j-th parameter, which would tear the row.
[[noreturn]] void refuse_torn_parameter(const Assembly& assembly, int j, int row);

/// The first parameter whose change of the rows, a column of `change`, redundant rows do not allow: of which `left`
/// cannot be met by the coordinates; and the row that it tears most. {-1, -1} where there is none.
std::pair<int, int> torn_parameter(const Eigen::MatrixXd& change, const Eigen::MatrixXd& left);

}  // namespace costate
