#include "costate/event/slip_offset_watch.h"

#include <cmath>

#include "costate/element/force/rigid_contact.h"
#include "costate/event/contact_gap.h"

namespace costate {

namespace {
// The sine of the angle from which on a velocity has turned, and in offsets the speed from which on it has a direction.
constexpr double kTurned = 0.01, kHasDirection = 100;
// Results are off by so many |o|/|v|.
constexpr double kMeasured = 10;
}  // namespace

double SlipOffsetWatch::Slip::part() const { return kMeasured * kSlidingOffset / fastest; }

SlipOffsetWatch::SlipOffsetWatch(const Mechanism& mechanism) {
  for (std::size_t f = 0; f < mechanism.forces().size(); ++f) {
    const Force& force = *mechanism.forces()[f];
    const auto* contact = dynamic_cast<const UnilateralForce*>(&force);
    if (contact && contact->row_count() == 3 && contact->closed_state() >= 0 && contact->sliding_state() >= 0)
      contacts_.push_back({&force, contact, mechanism.state_offsets()[f]});
  }
}

void SlipOffsetWatch::end(Contact& c) {
  if (c.turned && (!slowest_ || c.slip.fastest < slowest_->fastest)) slowest_ = c.slip;
  c.offset[0] = c.offset[1] = 0;
  c.turned = false;
}

void SlipOffsetWatch::look(const StateView& s, const Assembly& assembly) {
  for (Contact& c : contacts_) {
    const double* z = s.z + c.first_state;
    const bool slides = z[c.contact->closed_state()] > 0.5 && z[c.contact->sliding_state()] > 0.5;
    const double* offset = z + c.contact->sliding_state() + 1;
    if (!slides || offset[0] != c.offset[0] || offset[1] != c.offset[1]) end(c);
    if (!slides || (offset[0] == 0 && offset[1] == 0)) continue;
    if (c.offset[0] == 0 && c.offset[1] == 0) c.slip = {c.force->path(), s.t, 0};
    c.offset[0] = offset[0];
    c.offset[1] = offset[1];
    double v[2];
    for (int k = 0; k < 2; ++k) v[k] = row_of(*c.force, *c.contact, 1 + k, s, assembly, nullptr).c1;
    const double speed = std::hypot(v[0], v[1]), across = v[0] * offset[1] - v[1] * offset[0];
    c.slip.fastest = std::max(c.slip.fastest, speed);
    if (speed > kHasDirection * kSlidingOffset && std::abs(across) > kTurned * kSlidingOffset * speed) c.turned = true;
  }
}

std::optional<SlipOffsetWatch::Slip> SlipOffsetWatch::slowest() const {
  SlipOffsetWatch all = *this;
  for (Contact& c : all.contacts_) all.end(c);
  return all.slowest_;
}

}  // namespace costate
