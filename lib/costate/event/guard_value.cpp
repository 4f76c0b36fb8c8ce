#include "costate/event/guard_value.h"

#include "costate/assembly/slip_on_line.h"
#include "costate/element/force/rigid_contact.h"

namespace costate {

double guard_value(const Force& force, const GuardedForce& guarded, int k, int first_state, int first_row,
                   const StateView& s, const Assembly& assembly, GatheredState& buffer) {
  LocalState local = buffer.of(force, s, assembly.numbers());
  local.z = s.z + first_state;
  if (first_row >= 0 && s.lambda) local.lambda = s.lambda + first_row;
  return guarded.guard_value(k, local);
}

namespace {
struct Located {
  const Force* force = nullptr;
  const GuardedForce* guarded = nullptr;
  int k = 0, first_state = 0, first_row = -1;
};

Located locate(int event, const Mechanism& mech) {
  for (std::size_t f = 0; f < mech.forces().size(); ++f) {
    const Force& force = *mech.forces()[f];
    const auto* guarded = dynamic_cast<const GuardedForce*>(&force);
    if (!guarded) continue;
    if (event >= guarded->guard_count()) {
      event -= guarded->guard_count();
      continue;
    }
    Located at{&force, guarded, event, mech.state_offsets()[f]};
    if (const auto* unilateral = dynamic_cast<const UnilateralForce*>(&force))
      for (std::size_t i = 0; i < mech.constraints().size(); ++i)
        if (mech.constraints()[i].get() == unilateral->rows()) at.first_row = mech.row_offsets()[i];
    return at;
  }
  return {};
}

double value_of(const Located& at, const StateView& s, const Assembly& assembly) {
  if (!at.force) return 0;
  GatheredState buffer;
  return guard_value(*at.force, *at.guarded, at.k, at.first_state, at.first_row, s, assembly, buffer);
}
}  // namespace

double guard_value(int event, const StateView& s, const Assembly& assembly) {
  return value_of(locate(event, assembly.mechanism()), s, assembly);
}

double guard_value_from(int event, const StateView& begin, const StateView& s, const Assembly& assembly) {
  const Located at = locate(event, assembly.mechanism());
  const double value = value_of(at, s, assembly);
  const auto* contact = dynamic_cast<const UnilateralForce*>(at.force);
  if (!contact || contact->guard_kind(at.k) != UnilateralForce::Guard::stop || contact->row_count() < 3) return value;
  const auto slip = [&](const StateView& x) {
    Variation still;
    still.q = still.v = x.v;
    return SlipOnLine(assembly, x, still, at.first_row).w;
  };
  return slip(begin).dot(slip(s)) < 0 ? -value - kSlidingOffset : value;
}

}  // namespace costate
