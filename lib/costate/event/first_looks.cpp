// Where a run begins, and behind events: which guards count, and how soon what has left comes back.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/assembly/own_state.h"
#include "costate/base/error.h"
#include "costate/event/contact_gap.h"
#include "costate/event/contact_ways.h"
#include "costate/event/motion_events.h"
#include "costate/event/spatial_slip.h"

namespace costate {

namespace {
// Of all accelerations at the start: what leads across a guard from rest.
constexpr double kFromRest = 1e-9;
// Of the largest speed so far: less towards the ground is the integrator's.
constexpr double kFalls = 1e-8;
}  // namespace

void MotionEvents::begin(const StateView& at) {
  // Its own copy: where multipliers are asked for `at` lives in the formulation, which is asked for other states here.
  OwnState copy;
  copy.take({at.t, at.q, at.v, nullptr, at.lambda, at.z}, assembly_);
  const StateView s = copy.view();
  nearest_pass_.reset();
  for (ContactOf& c : contacts_) {  // another run begins
    if (!(s.t < c.decided)) continue;
    c.largest_approach = fastest_ = 0;
    c.died_at.clear();
    c.decided = -std::numeric_limits<double>::infinity();
  }
  reach_ = 0;
  require_sliding(s);
  // Of a contact that cannot stick, or is pulled, at the start beside others of its body that are closed.
  const auto shared = [&](const GuardOf& g) -> std::string {
    if (g.contact < 0 || contacts_[static_cast<std::size_t>(g.contact)].sliding_state < 0) return {};
    if (!sharing(g, s).empty() || held(g, s)) return " All that stick on one body were counted together.";
    const ContactOf& own = contacts_[static_cast<std::size_t>(g.contact)];
    const ContactOf* other = nullptr;
    std::size_t count = 1;
    for (const ContactOf& c : contacts_) {
      if (&c == &own || c.sliding_state < 0 || s.z[c.closed_state] < 0.5 ||
          c.force->coordinates() != own.force->coordinates())
        continue;
      if (!other) other = &c;
      ++count;
    }
    if (!other) return {};
    if (own.contact->guard_kind(g.k) != UnilateralForce::Guard::release)
      return fmt::format(
          " All that stick on one body begin with the same share of its friction: where '{}' can bear "
          "the rest, let this one slide, which it does at no speed.",
          other->force->path());
    if (count <= determining_contacts(own.force->coordinates().size())) return {};
    return fmt::format(
        " Who of {} bears how much of a body's weight is not determined, and shares are of least norm: where '{}' and "
        "others can bear it, this one touches and bears nothing.",
        count, other->force->path());
  };
  calc(s, before_);
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    GuardOf& g = guards_[i];
    const int direction = g.guarded->guard_direction(g.k);
    g.ready = before_[i] * direction < 0;
    g.last = before_[i];
    if (std::isnan(before_[i])) continue;
    // What another contact of its body holds slides at no speed.
    if (const ContactOf* c = contact_of(static_cast<int>(i));
        c && contact_guard(static_cast<int>(i)) == UnilateralForce::Guard::stop && !slides_in_space(*c) &&
        has_stopped(*c, s, acceleration_by_forces(s))) {
      g.ready = false;
      continue;
    }
    // At zero, but for rounding, it counts if it is about to cross; beyond, the start is of another mode. What has just
    // crossed the other way (another event at the same time begins anew) counts once it has been seen beyond rounding.
    load(g, s);
    double size = length_, speed = 0;
    for (std::size_t c = 0; c < q_.size(); ++c) {
      const double lever = g.gap ? levers_[static_cast<std::size_t>(g.force->coordinates()[c])] : 1;
      size = std::max(size, lever * std::abs(q_[c].v.c0));
      speed = std::max(speed, lever * std::abs(v_[c].v.c0));
      q_[c].v.c1 = v_[c].v.c0;
    }
    if (g.ready && std::abs(before_[i]) > kGapRounding * size) continue;
    t_.v.c1 = 1;
    const double rate = g.guarded->guard(g.k, arguments()).v.c1 * direction;
    const bool past = before_[i] * direction > 1e-9 * size;
    const std::string advice = g.guarded->past_at_start(g.k);
    if (past && !advice.empty())
      throw ModelError(g.force->path(), fmt::format("At the start '{}' has happened already, by {:.6g}: {}{}", g.name,
                                                    std::abs(before_[i]), advice, shared(g)));
    g.ready = !past && rate > 0;
    if (!past && !g.ready && rate >= -kGapRounding * speed) look_from_rest(g, s, direction);
  }
  find_hop(s);
}

// What begins at zero, and at rest, goes across or not by its acceleration. A touch of no speed closes nothing and
// bounces nothing: the start has to say that it is one.
void MotionEvents::look_from_rest(GuardOf& g, const StateView& s, int direction) {
  if (g.contact >= 0 && contact_guard(static_cast<int>(&g - guards_.data())) != UnilateralForce::Guard::touch) return;
  std::vector<double> x(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
  solve_motion(s, x.data());
  double largest = 0;
  for (int i = 0; i < assembly_.n(); ++i) largest = std::max(largest, std::abs(x[static_cast<std::size_t>(i)]));
  const double acceleration = course_of(g, s, x).c2 * direction;
  // What is pushed across later ends the run (require_seen).
  if (!(acceleration > kFromRest * largest) || !std::isfinite(acceleration)) return;
  const std::string advice = g.guarded->past_at_start(g.k);
  if (!advice.empty())
    throw ModelError(
        g.force->path(),
        fmt::format("At the start '{}' is at the point of happening, from rest: {} Or let it start a little away.",
                    g.name, advice));
  g.ready = true;
}

Taylor2 MotionEvents::course_of(const GuardOf& g, const StateView& s, const std::vector<double>& x) {
  load(g, s);
  const auto& coordinates = g.force->coordinates();
  for (std::size_t c = 0; c < q_.size(); ++c) {
    const double a = x[static_cast<std::size_t>(coordinates[c])];
    q_[c].v.c1 = v_[c].v.c0;
    q_[c].v.c2 = a;
    v_[c].v.c1 = a;
  }
  t_.v.c1 = 1;
  return g.guarded->guard(g.k, arguments()).v;
}

void MotionEvents::find_hop(const StateView& s) {
  last_hop_ = std::numeric_limits<double>::infinity();
  if (!impact_) return;
  std::vector<double> x;
  for (GuardOf& g : guards_) {
    if (!g.gap || !g.guarded->guard_armed(g.k, s.z + g.first_state)) continue;
    const int direction = g.guarded->guard_direction(g.k);
    const double here = value(g, s);
    if (!(std::abs(here) <= kAtGround * size_of(*g.force, s))) continue;
    if (std::isnan(g.last)) g.last = here;  // what has just let go
    if (x.empty()) {
      x.resize(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
      solve_motion(s, x.data());
    }
    const Taylor2 gap = course_of(g, s, x);
    if (gap.c1 * direction < 0 && gap.c2 * direction > 0) last_hop_ = std::min(last_hop_, -2 * gap.c1 / gap.c2);
  }
}

double MotionEvents::falls_back(const GuardOf& g, double begin, double end,
                                const std::function<StateView(double)>& at) {
  const int direction = g.guarded->guard_direction(g.k);
  std::vector<double> x(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
  const auto falls = [&](double t) {
    const StateView s = at(t);
    solve_motion(s, x.data());
    const Taylor2 gap = course_of(g, s, x);
    const double speed = gap.c1 * direction, lifts = -gap.c2 * direction, size = size_of(*g.force, s);
    // Of what rests all speeds are rounding, of those that forces make over a length.
    const double fastest = std::max(fastest_, std::sqrt(acceleration_by_forces(s) * size));
    return speed > kFalls * fastest && !(speed * speed < 2 * lifts * kGapRounding * size);
  };
  if (!falls(end)) return std::numeric_limits<double>::quiet_NaN();
  double since = begin, until = end;
  for (int k = 0; k < 30; ++k) {
    const double middle = 0.5 * (since + until);
    (falls(middle) ? until : since) = middle;
  }
  return until;
}

MotionEvents::History MotionEvents::history() const {
  History h{fastest_, {}};
  for (const ContactOf& c : contacts_) h.contacts.push_back({c.largest_approach, c.died_at, c.decided});
  return h;
}

void MotionEvents::recall(const History& history) {
  fastest_ = history.fastest;
  for (std::size_t i = 0; i < history.contacts.size(); ++i) {
    contacts_[i].largest_approach = history.contacts[i].largest_approach;
    contacts_[i].died_at = history.contacts[i].died_at;
    contacts_[i].decided = history.contacts[i].decided;
  }
}

}  // namespace costate
