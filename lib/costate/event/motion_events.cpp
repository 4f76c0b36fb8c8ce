#include "costate/event/motion_events.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "costate/base/error.h"
#include "costate/event/contact_gap.h"
#include "costate/event/contact_ways.h"
#include "costate/event/first_rows.h"
#include "costate/event/kept_states.h"
#include "costate/event/spatial_slip.h"
#include "costate/event/time_of_change.h"
#include "costate/event/unresolved_slip.h"
#include "costate/mechanism/coordinate_parts.h"
#include "costate/mechanism/guarded_forces.h"
#include "costate/mechanism/length_size.h"

namespace costate {

namespace {
// A speed of sliding the wrong way of this part of the largest one so far is the integrator's error.
constexpr double kWrongWay = 1e-5;
// Of a look, by powers of two: how near its beginning what begins at its limit is seen to fall back.
constexpr int kHalvings = 40;
// Of a look, to which the time is found at which what holds at its limit goes beyond.
constexpr double kOfStep = 1e-9;
constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
}  // namespace

bool MotionEvents::has_any(const Mechanism& mechanism) { return has_guarded_forces(mechanism); }

void MotionEvents::refuse(const Mechanism& mechanism, const std::string& what) {
  if (!has_any(mechanism)) return;
  throw CapabilityError(fmt::format(
      "This scene has events (contacts that touch and let go), which {} not carried across yet. Take idas or "
      "cvodes methods, which every formulation has for them.",
      what));
}

MotionEvents::MotionEvents(Assembly& assembly) : assembly_(assembly) {
  const Mechanism& mech = assembly.mechanism();
  const std::vector<int> parts = coordinate_parts(mech);
  const std::map<const Constraint*, int> rows = first_rows(mech);
  for (std::size_t f = 0; f < mech.forces().size(); ++f) {
    const Force& force = *mech.forces()[f];
    const auto* guarded = dynamic_cast<const GuardedForce*>(&force);
    if (!guarded) continue;
    int contact = -1, first_row = -1;
    if (const auto* unilateral = dynamic_cast<const UnilateralForce*>(&force)) {
      contact = static_cast<int>(contacts_.size());
      if (const auto own = rows.find(unilateral->rows()); own != rows.end()) first_row = own->second;
      const int state = unilateral->closed_state();
      const int sliding = unilateral->sliding_state(), first = mech.state_offsets()[f];
      contacts_.push_back({&force, unilateral, state < 0 ? -1 : first + state, sliding < 0 ? -1 : first + sliding,
                           first_row, parts[static_cast<std::size_t>(force.coordinates().front())]});
      needs_multipliers_ = needs_multipliers_ || first_row >= 0;
    }
    for (int k = 0; k < guarded->guard_count(); ++k)
      guards_.push_back({&force, guarded, k, mech.state_offsets()[f],
                         fmt::format("{}: {}", force.path(), guarded->guard_name(k)), contact, first_row, false,
                         false});
    const auto* gaps = dynamic_cast<const GapElement*>(&force);
    for (GuardOf& g : guards_)
      if (gaps && g.force == &force && gaps->gap_of_guard(g.k) >= 0)
        g.gap.emplace(force, *gaps, gaps->gap_of_guard(g.k));
  }
  shared_.resize(guards_.size());
  shares_.emplace(assembly, contacts_);
  if (!guards_.empty()) length_ = length_size(mech);
  levers_ = coordinate_levers(mech, length_);
}

double MotionEvents::size_of(const Force& force, const StateView& s) const {
  double largest = length_;
  for (const int c : force.coordinates())
    largest = std::max(largest, levers_[static_cast<std::size_t>(c)] * std::abs(s.q[c]));
  return largest;
}

double MotionEvents::largest_of(const double* x) const {
  double largest = 0;
  for (std::size_t i = 0; i < levers_.size(); ++i) largest = std::max(largest, levers_[i] * std::abs(x[i]));
  return largest;
}

void MotionEvents::load(const GuardOf& g, const StateView& s) {
  const auto& c = g.force->coordinates();
  q_.assign(c.size(), {});
  v_.assign(c.size(), {});
  for (std::size_t i = 0; i < c.size(); ++i) {
    q_[i] = PathDual(s.q[c[i]]);
    v_[i] = PathDual(s.v[c[i]]);
  }
  z_.assign(static_cast<std::size_t>(g.force->states()), {});
  for (std::size_t i = 0; i < z_.size(); ++i) z_[i] = PathDual(s.z[g.first_state + static_cast<int>(i)]);
  const auto& numbers = g.force->numbers();
  p_.assign(numbers.size(), {});
  for (std::size_t i = 0; i < p_.size(); ++i)
    p_[i] = PathDual(assembly_.numbers()[static_cast<std::size_t>(numbers[i])]);
  out_.assign(z_.size(), {});
  lambda_.clear();
  if (g.first_row >= 0 && s.lambda)
    for (int i = 0; i < contacts_[static_cast<std::size_t>(g.contact)].contact->row_count(); ++i)
      lambda_.emplace_back(s.lambda[g.first_row + i]);
  t_ = PathDual(s.t);
}

MeasureArguments MotionEvents::arguments() const {
  MeasureArguments x;
  x.t = t_;
  x.q = q_.data();
  x.v = v_.data();
  x.z = z_.data();
  x.p = p_.data();
  if (!lambda_.empty()) x.lambda = lambda_.data();
  return x;
}

double MotionEvents::value(const GuardOf& g, const StateView& s) {
  const double h = guard(g, s);
  const double slowest = slowest_slip(g);
  return slowest > 0 ? h + 0.5 * kSlidingOffset - slowest : h;
}

double MotionEvents::slowest_slip(const GuardOf& g) const {
  if (g.contact < 0) return 0;
  const ContactOf& c = contacts_[static_cast<std::size_t>(g.contact)];
  if (c.contact->guard_kind(g.k) != UnilateralForce::Guard::stop || !slides_in_space(c)) return 0;
  return std::max(0.5 * kSlidingOffset, slow_slips_ * g.largest_slip);
}

void MotionEvents::calc(const StateView& s, std::vector<double>& h) {
  h.assign(guards_.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    GuardOf& g = guards_[i];
    if (!g.guarded->guard_armed(g.k, s.z + g.first_state)) {
      g.largest_slip = 0;
      continue;
    }
    h[i] = value(g, s);
    if (const double slowest = slowest_slip(g); slowest > 0) g.largest_slip = std::max(g.largest_slip, h[i] + slowest);
  }
}

std::optional<MotionEvents::Hit> MotionEvents::find(double from, double to, const States& states,
                                                    const States& places) {
  double begin = from;
  thread_local KeptStates kept;
  kept.begin(assembly_);
  const States solved = [&](double t) { return kept(t, states); }, placed = [&](double t) { return kept(t, places); };
  if (needs_multipliers_) {
    const StateView last = states(to);  // not kept: the look at it is the last one, and a level goes on from there
    fastest_ = std::max(fastest_, largest_of(last.v));
    if (impact_) shares_->require_determined(last, impact_->balance(), velocity_error());
  }
  const bool anew = !(from == looked_until_);
  choose_looks(from, to, placed);
  // |w| of a slip in space falls below its offset for an instant only, while friction turns round: what slid forward at
  // the last look and slides back has stopped between. The way it slides is told by the guard's slopes.
  std::vector<double> forward, here_forward;
  const auto way = [&](const GuardOf& g, const StateView& s, std::vector<double>& of) {
    load(g, s);
    of.assign(v_.size(), 0);
    for (std::size_t i = 0; i < v_.size(); ++i) {
      v_[i].v.c1 = 1;
      of[i] = g.guarded->guard(g.k, arguments()).v.c1;
      v_[i].v.c1 = 0;
    }
  };
  // As the plane's: |w| less half the offset, negative where w points back.
  const auto along = [&](const GuardOf& g, const StateView& s) {
    way(g, s, here_forward);
    const double speed = value(g, s);
    return std::inner_product(forward.begin(), forward.end(), here_forward.begin(), 0.0) < 0
               ? -speed - 2 * slowest_slip(g)
               : speed;
  };
  const auto rounding_of_multipliers = [&](const StateView& s) {
    double largest = 0;
    for (int i = 0; i < assembly_.m(); ++i) largest = std::max(largest, std::abs(s.lambda[i]));
    return kContactRounding * largest;
  };
  for (const double end : looks_) {
    const StateView here = kept.keep(end, states);
    calc(here, after_);
    // What has just crossed is at zero but for rounding, which differs from that where it was found.
    double at_zero = 0;
    if (anew && end == from)
      for (int i = 0; i < assembly_.n(); ++i) at_zero = std::max(at_zero, kRounding * std::abs(here.q[i]));
    std::optional<Hit> first;
    for (std::size_t i = 0; i < guards_.size(); ++i) {
      GuardOf& g = guards_[i];
      const int direction = g.guarded->guard_direction(g.k);
      const States& at = by_multipliers(g) ? solved : placed;
      const double at_last_look = std::exchange(g.last, after_[i]);
      double a = begin, b = end;
      const bool comes = !std::isnan(after_[i]);
      if (a < b && comes == std::isnan(at_last_look)) meet_condition(g, comes, a, b, after_[i], at);
      if (std::isnan(after_[i])) {
        g.ready = g.just_left = false;
        continue;
      }
      const ContactOf* slides = g.contact < 0 ? nullptr : &contacts_[static_cast<std::size_t>(g.contact)];
      const bool turns = g.ready && slides && slides_in_space(*slides) &&
                         slides->contact->guard_kind(g.k) == UnilateralForce::Guard::stop;
      if (turns) {
        way(g, at(begin), forward);
        after_[i] = along(g, at(end));
      }
      const auto reach = [&](const StateView& s) { return turns ? along(g, s) : value(g, s); };
      if (g.just_left) {
        // It may begin a little below the ground, by what the integrator has let it drift, and what lets go leaves with
        // the cube of time: only beyond rounding it has left.
        const double before = value(g, at(begin)) * direction, size = size_of(*g.force, at(end)),
                     rounding = kGapRounding * size;
        if (after_[i] * direction < -rounding) {
          g.ready = true;
          g.just_left = false;
          continue;
        }
        // It may have left and come back within a part of this look.
        for (int k = 0; k < 50 && !(value(g, at(a)) * direction < -rounding); ++k)
          a = begin + (end - begin) * std::ldexp(1, -50 + k);
        g.ready = value(g, at(a)) * direction < -rounding;
        if (!g.ready) {
          if (const double t = falls_back(g, begin, end, placed); !std::isnan(t)) {
            if (!first || t < first->t) first = Hit{t, static_cast<int>(i)};
            continue;
          }
          // Integrators restart at order one, where positions go straight for a step: less than this is theirs.
          if (after_[i] * direction <= std::max(std::max(before, 0.0) + rounding, kAtGround * size)) continue;
          throw SolverError(
              fmt::format("At t = {:.9g} s '{}' falls into the ground that it has just left.", begin, g.name));
        }
        g.just_left = false;
      }
      // What another contact of its body holds slides at no speed, and has nothing to stop.
      if (!g.ready && slides && !slides_in_space(*slides) &&
          slides->contact->guard_kind(g.k) == UnilateralForce::Guard::stop &&
          has_stopped(*slides, at(end), acceleration_by_forces(at(end))))
        continue;
      if (after_[i] * direction < 0) {
        if (g.ready) continue;
        // A latch at its place, too.
        const double none = g.gap           ? at_zero
                            : g.contact < 0 ? kRounding * largest_coordinate(*g.force, here, levers_)
                                            : 0;
        g.ready = -after_[i] * direction > none;
        continue;
      }
      if (!g.ready) {
        if (g.contact >= 0) require_direction(g, after_[i], at(end));
        require_seen(g, at_last_look * direction, after_[i] * direction, at(end));
        // What holds at its limit, but for rounding, may go beyond it without having been on its own side.
        const auto holds = [&](double t) { return !(value(g, at(t)) * direction > rounding_of_multipliers(at(t))); };
        if (!by_multipliers(g) || std::isnan(at_last_look) || holds(b) || !holds(a)) continue;
        halve_to_change(a, b, kOfStep * (end - begin), holds);
        if (!first || b < first->t) first = Hit{b, static_cast<int>(i)};
        continue;
      }
      // In (a, b]: by halves and secants to the last bit, and then its far side.
      double ha = reach(at(a)) * direction, hb = after_[i] * direction;
      if (ha >= 0 && by_multipliers(g) && ha <= rounding_of_multipliers(at(a))) {
        // As another contact begins to slide this one may be at its limit, too, but for rounding, and fall back.
        if (a == b) continue;
        for (int k = kHalvings; k > 0 && ha >= 0; --k) {
          const double m = a + (b - a) * std::ldexp(1, -k), hm = reach(at(m)) * direction;
          if (hm >= 0) continue;
          a = m;
          ha = hm;
        }
      }
      if (ha >= 0) b = a;
      for (int k = 0; k < 200 && b - a > 2 * std::numeric_limits<double>::epsilon() * std::abs(b); ++k) {
        double m = k % 3 == 2 || !(hb > ha) ? 0.5 * (a + b) : a + (b - a) * (-ha / (hb - ha));
        // A secant's point near an end is moved inward so that the bracket shrinks from both sides.
        const double inward = 1e-3 * (b - a);
        if (!(m > a + inward * 1e-6) || !(m < b - inward * 1e-6)) m = 0.5 * (a + b);
        if (m <= a || m >= b) break;
        const double hm = reach(at(m)) * direction;
        (hm < 0 ? a : b) = m;
        (hm < 0 ? ha : hb) = hm;
      }
      // A slip that turns by a right angle between two looks does not stop.
      if (turns && value(g, at(b)) > kWrongWay * fastest_ + kSlidingOffset) continue;
      if (slowest_slip(g) > 0 && slip_error_.relative > 0 &&
          UnresolvedSlip(g.largest_slip, slip_error_.relative, slip_error_.absolute).yet() &&
          slides_from_rest(static_cast<int>(i), at(b)))
        continue;
      if (!turns && meets_alike(g, at(b), 0)) {
        g.ready = false;
        continue;
      }
      if (!first || b < first->t) first = Hit{b, static_cast<int>(i)};
    }
    if (first) {
      looked_until_ = std::numeric_limits<double>::quiet_NaN();
      guards_[static_cast<std::size_t>(first->event)].ready = false;
      return first;
    }
    begin = end;
  }
  return find_unresolved(from, to, placed);
}

// What has left by less than is seen of it, and comes back.
void MotionEvents::require_seen(const GuardOf& g, double last, double past, const StateView& s) {
  if (!g.gap || g.guarded->past_at_start(g.k).empty()) return;
  const double size = std::max(reach_, size_of(*g.force, s));
  if (last <= kAtGround * size && past > kAtGround * size)
    throw SolverError(fmt::format(
        "At t = {:.9g} s '{}' is past by {:.3g} m, and had not been seen to come: what it left from it left "
        "by less than rounding. Let what touches at the start begin a little away, or, where it came there later, take "
        "a smaller rtol.",
        s.t, g.name, past));
}

// What begins to slide has no speed, so that its guard is at zero; where it then slides the other way nothing stops it.
void MotionEvents::require_direction(const GuardOf& g, double along, const StateView& s) {
  const ContactOf& c = contacts_[static_cast<std::size_t>(g.contact)];
  if (c.contact->guard_kind(g.k) != UnilateralForce::Guard::stop) return;
  if (along < -kWrongWay * fastest_)
    throw SolverError(fmt::format(
        "At t = {:.9g} s {} slides against the direction in which it began to, at {:.3g} m/s: its friction "
        "pushes it there, so that no motion of rigid bodies with Coulomb friction goes on (Painleve), or it "
        "has turned within a step. Take less friction or kind = \"compliant\", or a smaller rtol.",
        s.t, c.force->path(), -along));
}

void MotionEvents::cross(int event, const StateView& before, double* v, double* z) {
  const GuardOf& g = of(event);
  if (between_steps_) refuse_slip_from_rest(event, before);
  last_jump_ = last_loss_ = 0;
  StateView behind = before;
  behind.v = v;
  behind.z = z;
  if (contact_of(event)) {
    cross_contact(event, before, v, z);
    return find_hop(behind);
  }
  load(g, before);
  g.guarded->transition(g.k, arguments(), out_.data());
  for (std::size_t i = 0; i < out_.size(); ++i) {
    const double jump = out_[i].v.c0 - z_[i].v.c0;
    if (std::abs(jump) > std::abs(last_jump_)) last_jump_ = jump;
    z[g.first_state + static_cast<int>(i)] = out_[i].v.c0;
  }
  find_hop(behind);
}

}  // namespace costate
