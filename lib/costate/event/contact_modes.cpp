// What closed contacts do behind an event: of all ways to stick, to slide and to open the one in which the ground
// pushes, nothing falls into it, and friction neither exceeds its limit nor pushes along (lib/README.md (19)). There
// are few contacts: they are gone through.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/event/contact_gap.h"
#include "costate/event/contact_ways.h"
#include "costate/event/motion_events.h"
#include "costate/event/slips_from_rest.h"
#include "costate/event/spatial_slip.h"
#include "costate/linear/sparse_pattern.h"

namespace costate {

namespace {
// A speed along the ground of this part of all speeds, or that accelerations make in this time, is none: in units of a
// second, or where they are large for the mechanism's length of the time that they take over so many times that.
constexpr double kStopped = 1e-9, kStopTime = 1e-9, kStopLengths = 10;
// A normal force this much larger than all others has gone through infinity.
constexpr double kUnbounded = 1e4;
}  // namespace

void MotionEvents::cross_contact(int event, const StateView& before, double* v, double* z) {
  using Guard = UnilateralForce::Guard;
  const Guard guard = contact_guard(event);
  const ContactOf* contact = contact_of(event);
  const bool touch = guard == Guard::touch;
  const std::vector<double> states(before.z, before.z + assembly_.nz());
  std::vector<double> after = states;
  std::vector<char> together(contacts_.size(), 0);  // strikes in the same instant; v may be that of `before`
  const auto state = [](std::vector<double>& of, int at) -> double& { return of[static_cast<std::size_t>(at)]; };
  std::vector<const ContactOf*> begin;
  std::vector<char> stops;
  if (guard == Guard::stop) stops = stopping(event, before);
  if (touch) {
    strike(event, before);
    for (std::size_t c = 0; c < contacts_.size(); ++c)
      together[c] = contacts_[c].part == contact->part &&
                    strikes_too(contacts_[c], before, assembly_, -impact_->speed_before(0), length_) > 0;
    double rate = -impact_->speed_before(0);
    for (int i = 0; i < assembly_.n(); ++i) v[i] = before.v[i] + jump_[static_cast<std::size_t>(i)];
    rate += expands_ ? expansion_->speed_after(0) : impact_->speed_after(0);
    last_jump_ = rate;
    for (const ContactOf& c : contacts_) {
      if (c.part != contact->part) continue;
      if (c.closed_state >= 0) state(after, c.closed_state) = c.closed ? 1 : 0;
      if (c.sliding_state >= 0) state(after, c.sliding_state) = c.slides;
    }
  } else {
    std::vector<double> stopped(before.v, before.v + assembly_.n());
    // In space a stop takes what is left along the ground, and what begins to slide has no drift.
    if (slides_in_space(*contact) && guard != Guard::release) {
      strike(event, before);
      for (std::size_t i = 0; i < stopped.size(); ++i) stopped[i] += jump_[i];
    }
    std::copy(stopped.begin(), stopped.end(), v);
    StateView sticking = before;
    sticking.v = v;
    if (guard == Guard::release) require_bounded(*contact, before);
    if (guard != Guard::stop) begin = let_go(of(event), sticking, after);
  }
  StateView behind = before;
  behind.v = v;
  settle(behind, after.data(), contact->part, of(event).name, begin, stops);
  std::copy(after.begin(), after.end(), z);
  behind.z = z;
  if (!begin.empty()) require_falling(event, before, behind);
  const double acceleration = std::max(largest_acceleration(behind), acceleration_by_forces(behind));
  for (GuardOf& other : guards_) {
    if (other.contact < 0) continue;
    const ContactOf& its = contacts_[static_cast<std::size_t>(other.contact)];
    if (its.part != contact->part) continue;
    const auto at = static_cast<std::size_t>(std::max(its.closed_state, 0));
    const bool was = its.closed_state >= 0 && states[at] > 0.5, is = its.closed_state >= 0 && after[at] > 0.5;
    const Guard kind = its.contact->guard_kind(other.k);
    if (kind == Guard::stop) {
      const double slides = is ? state(after, its.sliding_state) : 0;
      if (slides_in_space(its)) {
        other.ready = slides != 0;
        // What has stopped and slides on is another slip.
        if (its.closed_state >= 0 && slip_begins(its, states.data(), after.data())) other.largest_slip = 0;
        continue;
      }
      other.ready = slides != 0 && slides * row_of(*its.force, *its.contact, 1, behind, assembly_, nullptr).c1 > 0 &&
                    !has_stopped(its, behind, acceleration);
    } else if (kind != Guard::touch) {
      other.ready = is;
    } else if (!is && (was || &its == contact || together[static_cast<std::size_t>(other.contact)])) {
      other.ready = false;
      other.just_left = true;
    }
  }
  const bool closed = contact->closed_state >= 0 && state(after, contact->closed_state) > 0.5;
  const bool slides = closed && contact->sliding_state >= 0 && state(after, contact->sliding_state) != 0;
  last_mode_ = slides                                                                  ? "slides"
               : closed                                                                ? touch ? "closed" : "sticks"
               : touch && number(*contact, contact->contact->restitution_number()) > 0 ? "bounces"
                                                                                       : "open";
}

void MotionEvents::require_bounded(const ContactOf& c, const StateView& s) {
  std::vector<double> x(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
  solve_motion(s, x.data());
  double size = 0;
  for (const double force : assembly_.Q) size = std::max(size, std::abs(force));
  const double normal = std::abs(x[static_cast<std::size_t>(assembly_.n() + c.first_row)]);
  if (normal > kUnbounded * size && size > 0)
    throw SolverError(fmt::format(
        "At t = {:.9g} s the normal force of {} grows beyond all bounds as it slides: the laws of rigid bodies with "
        "Coulomb friction go no further (Painleve). Take less friction, or kind = \"compliant\".",
        s.t, c.force->path()));
}

// The impulses P of all rows: M (v+ - v-) + Phi_q^T P = 0.
void MotionEvents::require_pushing(const StateView& behind, const std::vector<double>& v_before) {
  constexpr double kOfImpulses = 1e-6;
  const auto closed = [&](const ContactOf& c) { return c.closed_state >= 0 && behind.z[c.closed_state] > 0.5; };
  if (!impact_ || std::none_of(contacts_.begin(), contacts_.end(), closed)) return;
  const auto n = static_cast<std::size_t>(assembly_.n());
  std::vector<double> dv(n), x(n + static_cast<std::size_t>(assembly_.m()), 0.0);
  for (std::size_t i = 0; i < n; ++i) dv[i] = behind.v[i] - v_before[i];
  impact_->balance().prepare(behind);
  add_product(assembly_.jacobian(), assembly_.phi_q.data(), 1, dv.data(), x.data() + n);
  impact_->balance().solve(x.data());
  double size = 0;
  for (std::size_t i = n; i < x.size(); ++i) size = std::max(size, std::abs(x[i]));
  for (const ContactOf& c : contacts_) {
    if (!closed(c)) continue;
    const double* impulse = x.data() + n + c.first_row;
    const double slides = c.sliding_state < 0 ? 0 : behind.z[c.sliding_state];
    const char* what = nullptr;
    if (impulse[0] > kOfImpulses * size)
      what = "the ground would have to pull";
    else if (c.sliding_state >= 0 && std::abs(slides) < 0.5 &&
             (c.contact->row_count() > 2 ? std::hypot(impulse[1], impulse[2]) : std::abs(impulse[1])) >
                 -number(c, c.contact->friction_number()) * impulse[0] + kOfImpulses * size)
      what = "it would begin to slide";
    else if (c.sliding_state >= 0 && !slides_in_space(c) && std::abs(slides) > 0.5 &&
             slides * row_of(*c.force, *c.contact, 1, behind, assembly_, nullptr).c1 < 0)
      what = "it would slide the other way";
    if (what)
      throw SolverError(fmt::format(
          "At t = {:.9g} s the law of a driver has a kink, where velocities jump, and of {} {}: what contacts do in "
          "the "
          "impulses of drivers is not carried. Take a law with a continuous slope, or kind = \"compliant\".",
          behind.t, c.force->path(), what));
  }
}

void MotionEvents::require_sliding(const StateView& s) {
  bool any = false;
  for (const ContactOf& c : contacts_)
    any = any || (c.sliding_state >= 0 && s.z[c.closed_state] > 0.5 && std::abs(s.z[c.sliding_state]) > 0.5);
  if (!any || !impact_) return;
  const double acceleration = largest_acceleration(s);
  for (const ContactOf& c : contacts_) {
    if (c.sliding_state < 0 || s.z[c.closed_state] < 0.5 || std::abs(s.z[c.sliding_state]) < 0.5) continue;
    const double speed = s.z[c.sliding_state] * row_of(*c.force, *c.contact, 1, s, assembly_, nullptr).c1;
    if (slides_in_space(c)) {
      if (has_stopped(c, s, acceleration))
        throw ModelError(c.force->path(),
                         "At the start it slides along its velocity, and has none: leave 'sliding' out.");
      continue;
    }
    if (speed < 0 && !has_stopped(c, s, acceleration))
      throw ModelError(c.force->path(), fmt::format("At the start it slides the other way, at {:.6g} m/s: see "
                                                    "'sliding'.",
                                                    -speed));
  }
  std::vector<double> z(s.z, s.z + assembly_.nz());
  std::set<int> parts;
  for (const ContactOf& c : contacts_) parts.insert(c.part);
  for (const int part : parts) settle(s, z.data(), part, "start", {}, {});
  for (const ContactOf& c : contacts_) {
    if (c.sliding_state < 0) continue;
    if (z[static_cast<std::size_t>(c.closed_state)] != s.z[c.closed_state])
      throw ModelError(c.force->path(), "At the start it leaves the ground: leave 'closed' out.");
    if (z[static_cast<std::size_t>(c.sliding_state)] != s.z[c.sliding_state])
      throw ModelError(c.force->path(), "At the start it does not slide so: see 'sliding'.");
  }
}

bool MotionEvents::has_stopped(const ContactOf& c, const StateView& s, double acceleration) const {
  double speed = std::abs(row_of(*c.force, *c.contact, 1, s, assembly_, nullptr).c1);
  if (slides_in_space(c)) speed = std::hypot(speed, row_of(*c.force, *c.contact, 2, s, assembly_, nullptr).c1);
  const double in_unit_time = std::min(acceleration, kStopLengths * std::sqrt(length_ * acceleration));
  return speed <= kStopped * largest_of(s.v) + kStopTime * in_unit_time;
}

double MotionEvents::largest_acceleration(const StateView& s) {
  bool slides = false;
  for (const ContactOf& c : contacts_)
    slides = slides || (c.sliding_state >= 0 && s.z[c.closed_state] > 0.5 && std::abs(s.z[c.sliding_state]) > 0.5);
  if (!slides) return 0;
  std::vector<double> x(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
  solve_motion(s, x.data());
  return largest_of(x.data());
}

void MotionEvents::solve_motion(const StateView& s, double* x) {
  const auto n = static_cast<std::size_t>(assembly_.n()), m = static_cast<std::size_t>(assembly_.m());
  impact_->balance().prepare(s);
  std::copy_n(assembly_.Q.data(), n, x);
  for (std::size_t i = 0; i < m; ++i) x[n + i] = -assembly_.bias[i];
  impact_->balance().solve(x);
}

void MotionEvents::settle(const StateView& s, double* z, int part, const std::string& event,
                          const std::vector<const ContactOf*>& begin, const std::vector<char>& stops) {
  std::vector<const ContactOf*> closed;
  std::vector<std::vector<int>> options;
  std::vector<char> rests;  // whether it has no speed along the ground
  StateView now = s;
  now.z = z;
  // At rest accelerations are rounding, of what forces by themselves would make.
  const double by_forces = acceleration_by_forces(now), acceleration = std::max(largest_acceleration(now), by_forces);
  const auto begins = [&](const ContactOf& c) { return std::find(begin.begin(), begin.end(), &c) != begin.end(); };
  const auto stops_now = [&](const ContactOf& c) {
    return !stops.empty() && stops[static_cast<std::size_t>(&c - contacts_.data())] != 0;
  };
  const double slides_as_begun =
      !begin.empty() && !slides_in_space(*begin.front()) ? z[begin.front()->sliding_state] : 0;
  for (const ContactOf& c : contacts_) {
    if (c.part != part || c.closed_state < 0 || z[c.closed_state] < 0.5) continue;
    closed.push_back(&c);
    const double along = c.sliding_state < 0 ? 0 : z[c.sliding_state];
    const int way = along > 0.5 ? kForward : along < -0.5 ? kBackward : kSticks;
    const bool stays = way == kSticks || begins(c) || stops_now(c) || has_stopped(c, s, acceleration);
    rests.push_back(stays);
    if (begins(c))
      options.push_back({way});
    else if (c.sliding_state < 0 || !stays)
      options.push_back({way, kOpen});
    // What stops sticks if it can: of corners of one body one could as well slide at no speed against another one, and
    // does where that one begins to slide the other way. Else what it did comes first.
    else if (const bool first = !stops.empty() || way == kSticks || along * slides_as_begun < 0; slides_in_space(c))
      options.push_back(first ? std::vector<int>{kSticks, kForward, kOpen}
                              : std::vector<int>{kForward, kSticks, kOpen});
    else if (const int ahead = way == kBackward ? kBackward : kForward, back = ahead == kForward ? kBackward : kForward;
             first)
      options.push_back({kSticks, ahead, back, kOpen});
    else
      options.push_back({ahead, kSticks, back, kOpen});
  }
  if (closed.empty()) return;
  const auto n = static_cast<std::size_t>(assembly_.n()), m = static_cast<std::size_t>(assembly_.m());
  std::vector<double> x(n + m), found;
  std::vector<char> from_rest(closed.size(), 0);  // whether a contact in space may begin to slide where it is
  for (std::size_t c = 0; c < closed.size(); ++c)
    from_rest[c] = slides_in_space(*closed[c]) && rests[c] && (!begins(*closed[c]) || friction_falls(*closed[c]));
  std::optional<SlipSearch> search;
  if (std::any_of(from_rest.begin(), from_rest.end(), [](char c) { return c != 0; })) {
    std::vector<double> open_z(z, z + assembly_.nz());
    for (const ContactOf* c : closed) open_z[static_cast<std::size_t>(c->closed_state)] = 0;
    StateView open = s;
    open.z = open_z.data();
    solve_motion(open, x.data());
    search.emplace(search_from_rest(*expansion_, assembly_, open, x.data(), z, closed, from_rest));
  }
  const auto slips = [&](const std::vector<int>& ways) -> std::vector<Slips> {
    if (!search) return {Slips(closed.size(), Eigen::Vector2d::Zero())};
    for (std::size_t c = 0; c < closed.size(); ++c) search->take(c, ways[c], false, search->contact(c).normal);
    return search->slips();
  };
  const auto write = [&](const std::vector<int>& ways, const Slips& slip) {
    for (std::size_t c = 0; c < closed.size(); ++c) {
      z[closed[c]->closed_state] = ways[c] == kOpen ? 0 : 1;
      if (closed[c]->sliding_state >= 0) z[closed[c]->sliding_state] = slides(ways[c]);
      if (!slides_in_space(*closed[c])) continue;
      if (slides(ways[c]) == 0) clear_slip(closed[c]->sliding_state, z);
      if (slides(ways[c]) == 0 || !from_rest[c]) continue;
      // What speed there is, of rounding, has no say in where it slides.
      offset_slip(closed[c]->sliding_state, slip[c].data(), z);
      for (int k = 0; k < 2; ++k)
        z[closed[c]->sliding_state + 1 + k] -=
            row_of(*closed[c]->force, *closed[c]->contact, 1 + k, s, assembly_, nullptr).c1;
    }
  };
  // Where friction reaches a limit it is known as well as the instant: one that sticks on may be as far beyond its own.
  const double beyond = !begin.empty() || !stops.empty() ? kSameMotion : kContactRounding;
  const auto fits = [&](const std::vector<int>& ways, const Slips& slip) {
    if (std::any_of(x.begin(), x.end(), [](double value) { return !std::isfinite(value); })) return false;
    const double accelerations = std::max(by_forces, largest_of(x.data()));
    double forces = 0;
    for (std::size_t i = 0; i < m; ++i) forces = std::max(forces, std::abs(x[n + i]));
    StateView solved = now;
    solved.lambda = x.data() + n;
    for (std::size_t c = 0; c < closed.size(); ++c) {
      const ContactOf& at = *closed[c];
      const double* lambda = x.data() + n + at.first_row;
      if (ways[c] == kOpen) {
        if (row_of(*at.force, *at.contact, 0, s, assembly_, x.data()).c2 < -kContactRounding * accelerations)
          return false;
        continue;
      }
      const int number = static_cast<int>(&at - contacts_.data());
      const auto* together = impact_ ? shares_->find(number, solved, impact_->balance(), velocity_error()) : nullptr;
      if ((together ? together->weight() : -lambda[0]) < -kContactRounding * forces) return false;
      if (at.sliding_state < 0 || (begins(at) && !from_rest[c])) continue;
      if (const int direction = slides(ways[c]); direction == 0) {
        if (!sticks_within_limits(at, solved, beyond * forces)) return false;
      } else if (rests[c]) {
        const auto along = [&](int row) { return row_of(*at.force, *at.contact, row, s, assembly_, x.data()).c2; };
        const double faster = from_rest[c] ? slip[c][0] * along(1) + slip[c][1] * along(2) : direction * along(1);
        if (faster < -kContactRounding * accelerations) return false;
      }
    }
    return true;
  };
  std::vector<int> chosen;
  Slips chosen_slip;
  // What rests in space goes on to rest where any shares hold it.
  const auto goes_on_to_rest = [&] {
    for (std::size_t c = 0; c < chosen.size(); ++c)
      if (from_rest[c] && chosen[c] != kSticks) return false;
    return !chosen.empty() && std::count(from_rest.begin(), from_rest.end(), 1) > 1;
  };
  std::string undetermined;
  const auto names = [&] {
    std::vector<std::string> list;
    for (const ContactOf* c : closed) list.push_back(c->force->path());
    return fmt::format("{}", fmt::join(list, ", "));
  };
  // Two that stick on one body hold it twice along the ground, which not all formulations carry.
  const bool redundant =
      std::count_if(closed.begin(), closed.end(), [](const ContactOf* c) { return c->sliding_state >= 0; }) > 1;
  const char* advice = redundant
                           ? " Where several hold one body who bears how much of its weight and of the friction is "
                             "not determined, and its motion may not be."
                           : "";
  const auto falls = [&](const ContactOf& c) { return friction_falls(c); };
  const auto look_at = [&](const std::vector<int>& ways, const Slips& slip) {
    write(ways, slip);
    StateView at = s;
    at.z = z;
    try {
      solve_motion(at, x.data());
    } catch (const SolverError& e) {  // rows that depend on each other, or a pole of the normal force
      undetermined = e.what();
      return;
    }
    if (!fits(ways, slip)) return;
    const auto choose = [&] {
      chosen = ways;
      chosen_slip = slip;
      found.assign(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(n));
    };
    if (chosen.empty()) return choose();
    if (are_one_motion(found, x.data(), levers_, kSameMotion * by_forces)) return;
    // Between the limits of sticking and of sliding both are motions: what rests goes on to rest.
    if (rests_more(closed, chosen, ways, falls)) return;
    if (rests_more(closed, ways, chosen, falls)) return choose();
    throw SolverError(fmt::format(
        "At t = {:.9g} s, behind '{}', the motion has several solutions, in which contacts ({}) do "
        "different things: the laws of rigid bodies with Coulomb friction do not choose between them "
        "(Painleve), or errors of the size of the tolerance do. Take a smaller rtol, less friction, or kind = "
        "\"compliant\".{}",
        s.t, event, names(), advice));
  };
  const bool few = for_all_ways(options, [&](const std::vector<int>& ways) {
    if ((search && search->proven() && !chosen.empty()) || goes_on_to_rest()) return;
    for (const Slips& slip : slips(ways)) look_at(ways, slip);
  });
  if (!few)
    throw CapabilityError(
        fmt::format("{} contacts are closed behind '{}': that is more ways than are gone through, {}.", closed.size(),
                    event, kMostWays));
  if (chosen.empty())
    throw CapabilityError(fmt::format(
        "At t = {:.9g} s, behind '{}', no way to stick, to slide or to open is a motion of the contacts that touch "
        "({}){}: the laws of rigid bodies with Coulomb friction have no solution there (Painleve), or an impact of "
        "more "
        "than one instant.{} Take kind = \"compliant\".{}",
        s.t, event, names(), search ? search->told() : "", undetermined.empty() ? "" : " " + undetermined, advice));
  if (const std::size_t count =
          sharing_unlike(closed, chosen, [&](const ContactOf& c) { return number(c, c.contact->friction_number()); }))
    throw SolverError(fmt::format(
        "At t = {:.9g} s, behind '{}', {} contacts hold one body, more than determine who bears how much of its "
        "weight, and slide with different friction ({}): the motion is not determined. Give them one "
        "friction_coefficient, or kind = \"compliant\".",
        s.t, event, count, names()));
  if (search && !search->proven() && search->starts() > 0 && !goes_on_to_rest())
    notice(
        fmt::format("Of contacts ({}) several may begin to slide in space at once{}: one motion was found, and that "
                    "there is no other is not proven.",
                    names(), search->told()));
  write(chosen, chosen_slip);
  shares_->require_determined(now, impact_->balance(), velocity_error(), part);
}

}  // namespace costate
