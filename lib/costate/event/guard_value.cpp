#include "costate/event/guard_value.h"

#include "costate/element/unilateral_force.h"

namespace costate {

double guard_value(const Force& force, const GuardedForce& guarded, int k, int first_state, int first_row,
                   const StateView& s, const Assembly& assembly, std::vector<double>& buffer) {
  const auto& c = force.coordinates();
  const auto& numbers = force.numbers();
  buffer.resize(2 * c.size() + numbers.size());
  double *q = buffer.data(), *v = q + c.size(), *p = v + c.size();
  for (std::size_t i = 0; i < c.size(); ++i) {
    q[i] = s.q[c[i]];
    v[i] = s.v[c[i]];
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) p[i] = assembly.numbers()[static_cast<std::size_t>(numbers[i])];
  LocalState local;
  local.t = s.t;
  local.q = q;
  local.v = v;
  local.z = s.z + first_state;
  local.p = p;
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
    std::vector<double> buffer;
    return guard_value(force, *guarded, event, mech.state_offsets()[f], first_row, s, assembly, buffer);
  }
  return 0;
}

}  // namespace costate
