// Slips in space: which of them are slow, where they stop, and the refusal of those who cannot follow one that begins
// from rest. From there its direction turns the faster the slower it is, and towards the stop again: what is stored of
// a motion tells w to its error e, and the direction to e/|w| (lib/README.md (19.12)).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/event/contact_gap.h"
#include "costate/event/motion_events.h"
#include "costate/event/spatial_slip.h"

namespace costate {

namespace {
// Feet of one body end to slide in one instant: so many times the speed of the one that is seen to is as slow, and so
// is this speed [m/s].
constexpr double kAsSlow = 3, kStopsWith = 30 * kSlidingOffset;
}  // namespace

MotionEvents::Slowest MotionEvents::slowest_in_space(const StateView& s) {
  Slowest all;
  for (GuardOf& g : guards_) {
    if (!stops_in_space(g)) continue;
    if (!slides_now(g, s.z)) {  // one that begins as the last one did is another
      g.largest_in_space = g.offset[0] = g.offset[1] = 0;
      continue;
    }
    const double* o = s.z + contacts_[static_cast<std::size_t>(g.contact)].sliding_state + 1;
    if (o[0] != g.offset[0] || o[1] != g.offset[1]) g.largest_in_space = 0;
    std::copy_n(o, 2, g.offset);
    const double speed = value(g, s) + slowest_slip(g);
    g.largest_in_space = std::max(g.largest_in_space, speed);
    all.speed = std::min(all.speed, speed);
    all.part = std::min(all.part, speed / g.largest_in_space);
  }
  return all;
}

bool MotionEvents::may_slip_in_space() const {
  return std::any_of(guards_.begin(), guards_.end(), [this](const GuardOf& g) { return stops_in_space(g); });
}

bool MotionEvents::stops_slip(int event, const double* z) const {
  return stops_in_space(of(event)) && slides_now(of(event), z);
}

bool MotionEvents::same_modes(const double* z, const double* other) const {
  for (const ContactOf& c : contacts_)
    for (const int state : {c.closed_state, c.sliding_state})
      if (state >= 0 && std::abs(z[state] - other[state]) > 0.5) return false;
  return true;
}

bool MotionEvents::stops_in_space(const GuardOf& g) const {
  if (g.contact < 0) return false;
  const ContactOf& c = contacts_[static_cast<std::size_t>(g.contact)];
  return slides_in_space(c) && c.contact->guard_kind(g.k) == UnilateralForce::Guard::stop;
}

std::vector<char> MotionEvents::stopping(int event, const StateView& before) {
  std::vector<char> stops(contacts_.size(), 0);
  const ContactOf& own = *contact_of(event);
  stops[static_cast<std::size_t>(of(event).contact)] = 1;
  if (!stops_in_space(of(event))) return stops;
  const auto speed = [&](const ContactOf& c) { return slip_of(c, before, assembly_).norm(); };
  const double slow = std::max(kAsSlow * speed(own), kStopsWith);
  const auto slips = [&](std::size_t i) {
    const ContactOf& c = contacts_[i];
    return stops[i] == 0 && slides_in_space(c) && c.part == own.part && before.z[c.closed_state] > 0.5 &&
           before.z[c.sliding_state] != 0;
  };
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    if (slips(i) && contacts_[i].force->coordinates() == own.force->coordinates() && speed(contacts_[i]) <= slow)
      stops[i] = 1;
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    if (slips(i) && slides_as(contacts_[i], stops, before)) stops[i] = 1;
  return stops;
}

bool MotionEvents::slides_now(const GuardOf& g, const double* z) const {
  const ContactOf& c = contacts_[static_cast<std::size_t>(g.contact)];
  const auto closed = [&](const ContactOf& of) { return of.closed_state >= 0 && z[of.closed_state] > 0.5; };
  if (!closed(c) || std::abs(z[c.sliding_state]) < 0.5) return false;
  if (z[c.sliding_state + 1] != 0 || z[c.sliding_state + 2] != 0) return true;
  // Feet that have been given velocities stop one by one, however near to each other.
  return std::none_of(contacts_.begin(), contacts_.end(),
                      [&](const ContactOf& other) { return &other != &c && other.part == c.part && closed(other); });
}

bool MotionEvents::slides_from_rest(int event, const StateView& before) {
  using Guard = UnilateralForce::Guard;
  const ContactOf* own = contact_of(event);
  if (!own || contact_guard(event) == Guard::release) return false;
  if (contact_guard(event) == Guard::slip_forward) return slides_in_space(*own);
  const auto spatial = [](const ContactOf& c) { return slides_in_space(c); };
  if (std::none_of(contacts_.begin(), contacts_.end(), spatial)) return false;
  // As cross_contact() has it.
  const int n = assembly_.n(), nz = assembly_.nz();
  const bool touch = contact_guard(event) == Guard::touch;
  if (touch || slides_in_space(*own)) strike(event, before);
  std::vector<double> v(before.v, before.v + n), z(before.z, before.z + nz);
  if (touch || slides_in_space(*own))
    for (int i = 0; i < n; ++i) v[static_cast<std::size_t>(i)] += jump_[static_cast<std::size_t>(i)];
  const auto state = [&](int i) -> double& { return z[static_cast<std::size_t>(i)]; };
  for (const ContactOf& c : contacts_) {
    if (!touch || c.part != own->part) continue;
    if (c.closed_state >= 0) state(c.closed_state) = c.closed ? 1 : 0;
    if (c.sliding_state >= 0) state(c.sliding_state) = c.slides;
  }
  StateView behind = before;
  behind.v = v.data();
  const std::vector<double> from = z;
  settle(behind, z.data(), own->part, of(event).name, {}, touch ? std::vector<char>{} : stopping(event, before));
  return std::any_of(contacts_.begin(), contacts_.end(),
                     [&](const ContactOf& c) { return spatial(c) && slip_begins(c, from.data(), z.data()); });
}

void MotionEvents::refuse_slip_from_rest(int event, const StateView& before) {
  // Behind it the direction turns the faster the slower the slip is: what there is between steps is too coarse.
  if (!carries_slips_from_rest_ && slides_from_rest(event, before))
    throw CapabilityError(
        fmt::format("At t = {:.9g} s, at '{}', sliding in space begins from rest, which discrete methods of explicit "
                    "steps do not carry: no step tells its direction where it is slow. Take idas, cvodes or "
                    "hand-derived methods, or discrete ones on radau5.",
                    before.t, of(event).name));
}

int MotionEvents::begins_from_rest(int event, const StateView& before, const double* z_after) const {
  int row = -1;
  for (const ContactOf& c : contacts_) {
    if (!slides_in_space(c) || !slip_begins(c, before.z, z_after)) continue;
    const bool by_itself = &c == contact_of(event) && contact_guard(event) == UnilateralForce::Guard::slip_forward;
    if (!by_itself || friction_falls(c))
      throw CapabilityError(fmt::format(
          "At t = {:.9g} s, at '{}', {} begins to slide in space from rest, in a direction that {} decides: "
          "methods of fixed steps do not carry its derivative. Take idas, cvodes or hand-derived methods, "
          "or discrete ones on radau5.",
          before.t, of(event).name, c.force->path(),
          by_itself ? "the fall of its friction" : "the impact or the other contact"));
    row = c.first_row;
  }
  return row;
}

}  // namespace costate
