// Lays a cost's gradient out along a DAE's unknowns (q, v, z, a, lambda, ...).
#pragma once

#include <algorithm>

#include "costate/objective/output.h"

namespace costate {

inline void copy_cost_gradient(const ScalarGradient& g, double* y, double c, double* rho) {
  for (const auto* block : {&g.q, &g.v, &g.z, &g.a, &g.lambda})
    y = std::copy(block->data(), block->data() + block->size(), y);
  if (rho)
    for (Eigen::Index j = 0; j < g.rho.size(); ++j) rho[j] += c * g.rho[j];
}

}  // namespace costate
