// Rows J(q) v = 0 that are no rates of places, as a sphere that rolls has them (element/switched_rows.h): they bind
// velocities alone, and d/dt J is not (J v)_q.
#pragma once

#include <string>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

/// Rows that are there and bind velocities alone; empty where no element has any.
std::vector<int> rolling_rows(const Assembly& assembly);
/// Rows that are there and have no place for the start to meet: those, and what sticks wherever it is.
std::vector<int> rows_without_place(const Assembly& assembly);
/// Throws CapabilityError where there are rolling ones: for `what`, which knows rows of places alone ("An
/// equilibrium").
void refuse_rolling(const Assembly& assembly, const std::string& what);
/// d/dt J - (J v)_q of the rows that roll, on the Jacobian's pattern and zero elsewhere; empty where none does.
std::vector<double> rolling_twist(Assembly& assembly, const StateView& s);
/// r2_v, of rows of places 2 phid_q + ..., becomes that of all rows: gains d/dt J - (J v)_q of those that roll.
void add_rolling_rates(Assembly& assembly, const StateView& s, std::vector<double>& r2_v);

}  // namespace costate
