#include "costate/event/guard_value.h"

#include "costate/element/unilateral_force.h"

namespace costate {

double guard_value(const Force& force, const GuardedForce& guarded, int k, int first_state, int first_row,
                   const StateView& s, const Assembly& assembly, GatheredState& buffer) {
  LocalState local = buffer.of(force, s, assembly.numbers());
  local.z = s.z + first_state;
  if (first_row >= 0 && s.lambda) local.lambda = s.lambda + first_row;
  return guarded.guard_value(k, local);
}

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
    int first_row = -1;
    if (const auto* unilateral = dynamic_cast<const UnilateralForce*>(&force))
      for (std::size_t i = 0; i < mech.constraints().size(); ++i)
        if (mech.constraints()[i].get() == unilateral->rows()) first_row = mech.row_offsets()[i];
    GatheredState buffer;
    return guard_value(force, *guarded, event, mech.state_offsets()[f], first_row, s, assembly, buffer);
  }
  return 0;
}

}  // namespace costate
