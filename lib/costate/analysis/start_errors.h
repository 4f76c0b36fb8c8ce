// What the start and the equilibrium say when the mechanism cannot be closed or is given too much or too
// little.
#pragma once

#include <string>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

/// Throws if the number of `given` values (names) is not that of the degrees of freedom at q. `what`:
/// "positions" or "velocities"; with `fewer_allowed` only too many are refused.
void require_given_count(Assembly& assembly, double t, const double* q, const std::vector<std::string>& given,
                         const char* what, bool fewer_allowed = false);

/// Throws for positions that cannot be reached: `residual` of [Phi; B q - b] with the names of the rows of B.
[[noreturn]] void throw_unreachable(const Assembly& assembly, const Eigen::VectorXd& residual,
                                    const std::vector<std::string>& given);

}  // namespace costate
