#include "costate/event/guard_value.h"

#include <vector>

#include "costate/element/guarded_force.h"
#include "costate/element/unilateral_force.h"

namespace costate {

double guard_value(int event, const StateView& s, const Assembly& assembly) {
  const Mechanism& mech = assembly.mechanism();
  for (std::size_t f = 0; f < mech.forces().size(); ++f) {
    const Force& force = *mech.forces()[f];
    const auto* guarded = dynamic_cast<const GuardedForce*>(&force);
    if (!guarded) continue;
    if (event >= guarded->guard_count()) {
      event -= guarded->guard_count();
      continue;
    }
    std::vector<double> q, v, p;
    for (const int c : force.coordinates()) {
      q.push_back(s.q[c]);
      v.push_back(s.v[c]);
    }
    for (const int number : force.numbers()) p.push_back(assembly.numbers()[static_cast<std::size_t>(number)]);
    LocalState local;
    local.t = s.t;
    local.q = q.data();
    local.v = v.data();
    local.z = s.z + mech.state_offsets()[f];
    local.p = p.data();
    if (const auto* unilateral = dynamic_cast<const UnilateralForce*>(&force); unilateral && s.lambda)
      for (std::size_t i = 0; i < mech.constraints().size(); ++i)
        if (mech.constraints()[i].get() == unilateral->rows()) local.lambda = s.lambda + mech.row_offsets()[i];
    return guarded->guard_value(event, local);
  }
  return 0;
}

}  // namespace costate
