#include "costate/assembly/friction_rows.h"

namespace costate {

void add_friction_rows(const Assembly& assembly, const std::vector<double>& along, std::vector<double>& rows) {
  const SparsePattern& pattern = assembly.jacobian();
  for (const Assembly::SlidingRow& r : assembly.sliding_rows())
    for (int j = 0; j < pattern.cols; ++j)
      if (const auto e = pattern.find(r.along, j); e >= 0)
        rows[static_cast<std::size_t>(pattern.find(r.normal, j))] -=
            assembly.friction(r) * along[static_cast<std::size_t>(e)];
}

void calc_reaction_rows(const Assembly& assembly, std::vector<double>& phi_r) {
  phi_r = assembly.phi_q;
  add_friction_rows(assembly, assembly.reaction_jacobian(), phi_r);
}

void add_friction_multipliers(const Assembly& assembly, double* lambda) {
  for (const Assembly::SlidingRow& r : assembly.sliding_rows())
    lambda[r.along] = -assembly.friction(r) * lambda[r.normal];
}

void pull_friction_multipliers(const Assembly& assembly, double* weights) {
  for (const Assembly::SlidingRow& r : assembly.sliding_rows()) {
    weights[r.normal] -= assembly.friction(r) * weights[r.along];
    weights[r.along] = 0;
  }
}

}  // namespace costate
