#include "costate/formulation/penalty_weight.h"

#include <algorithm>
#include <cmath>

#include "costate/assembly/assembly.h"

namespace costate {

double default_penalty_weight(const std::shared_ptr<const Mechanism>& mechanism) {
  Assembly assembly(mechanism, ParameterSelection{});
  std::vector<double> q;
  for (const auto& c : mechanism->coordinates()) q.push_back(mechanism->numbers()[c.position_number].value);
  StateView s;
  s.q = s.v = q.data();
  assembly.calc_mass(s);
  double largest = 0;
  for (double x : assembly.M) largest = std::max(largest, std::abs(x));
  return 1e8 * (largest > 0 ? largest : 1.0);
}

Stabilization penalty_stabilization(const std::shared_ptr<const Mechanism>& mechanism, const FormulationOptions& o) {
  const double alpha = o.penalty_alpha > 0 ? o.penalty_alpha : default_penalty_weight(mechanism);
  return {o.penalty_xi, o.penalty_omega_rad_per_s, 1 / alpha};
}

}  // namespace costate
