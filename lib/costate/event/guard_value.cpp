#include "costate/event/guard_value.h"

namespace costate {

double guard_value(const Force& force, const GuardedForce& guarded, int k, int first_state, int first_row,
                   const StateView& s, const Assembly& assembly, GatheredState& buffer) {
  LocalState local = buffer.of(force, s, assembly.numbers());
  local.z = s.z + first_state;
  if (first_row >= 0 && s.lambda) local.lambda = s.lambda + first_row;
  return guarded.guard_value(k, local);
}

}  // namespace costate
