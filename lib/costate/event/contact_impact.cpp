// Impacts of rigid contacts (lib/README.md (19)): of all ways that the contacts in play have, open, sticking or
// sliding, the one in which the ground pushes where they are closed, nothing moves into it where they are open, and
// friction neither exceeds its limit nor pushes along. Newton's law gives speeds back; Poisson's is two impacts, a
// compression without restitution and an expansion with the share of its impulses. Who takes part, and with which
// restitution; the ways are gone through in event/impact_ways.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/event/contact_gap.h"
#include "costate/event/contact_ways.h"
#include "costate/event/motion_events.h"
#include "costate/event/spatial_slip.h"

namespace costate {

namespace {
// A bounce this much slower than the fastest one before: bounces that die out, infinitely many in finite time.
constexpr double kDiesOut = 1e-6;
// So is one that lifts by less than this part of the coordinates: looks at a gap find less of it than kGapRounding.
constexpr double kUnseenHop = 4 * kGapRounding;
// Of the accelerations that forces make: less towards the ground is their rounding.
constexpr double kPresses = 1e-9;
}  // namespace

std::vector<MotionEvents::InPlay> MotionEvents::find_in_play(int event, const StateView& before, double speed) {
  ContactOf& own = contacts_[static_cast<std::size_t>(of(event).contact)];
  // Whether a contact that strikes with this approach speed bounces; if not it closes.
  const auto bounces_off = [&](ContactOf& c, double approach) {
    if (!(number(c, c.contact->restitution_number()) > 0)) return false;
    if (c.closed_state >= 0 && approach < number(c, c.contact->closing_speed_number())) return false;
    if (!has_died_out(c, before, approach)) return true;
    if (c.closed_state < 0)
      throw SolverError(fmt::format(
          "At t = {:.9g} s '{}' has an approach speed of {:.3g} m/s, where it once had {:.3g}: its bounces die out, "
          "infinitely many of them. Leave '{}.closing_speed_m_per_s' out, so that it closes, or end the run before.",
          before.t, of(event).name, approach, c.largest_approach, c.force->path()));
    return false;
  };
  std::vector<InPlay> in_play;
  const auto strikes = [&](ContactOf& c, double approach) {
    const bool bounces = bounces_off(c, approach);
    in_play.push_back({&c, bounces, bounces ? number(c, c.contact->restitution_number()) : 0, {}, 0, kSticks});
  };
  strikes(own, speed);
  for (ContactOf& c : contacts_) {
    if (&c == &own || c.part != own.part) continue;
    if (c.closed_state >= 0 && before.z[c.closed_state] > 0.5) {
      const double along = c.sliding_state < 0 ? 0 : before.z[c.sliding_state];
      in_play.push_back({&c, false, 0, {}, 0, along > 0.5 ? kForward : along < -0.5 ? kBackward : kSticks});
    } else if (const double approach = strikes_too(c, before, assembly_, speed, length_); approach > 0) {
      c.largest_approach = std::max(c.largest_approach, approach);
      if (approach > kHardlyLeaves * speed)
        strikes(c, approach);
      else
        in_play.push_back({&c, c.closed_state < 0, number(c, c.contact->restitution_number()), {}, 0, kSticks});
    }
  }
  return in_play;
}

bool MotionEvents::has_died_out(ContactOf& c, const StateView& before, double approach) {
  if (before.t <= c.decided) return std::find(c.died_at.begin(), c.died_at.end(), before.t) != c.died_at.end();
  c.decided = before.t;
  std::vector<double> x(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
  solve_motion(before, x.data());
  const double fall = -row_of(*c.force, *c.contact, 0, before, assembly_, x.data()).c2;
  // What nothing presses leaves for good, however slowly.
  bool dies = fall > kPresses * acceleration_by_forces(before);
  if (dies && !(approach < (c.closed_state < 0 ? kDiesOut : kHardlyLifts) * c.largest_approach)) {
    // The next hop, to v^2/(2 a), is not seen.
    const double leaves = number(c, c.contact->restitution_number()) * approach;
    dies = leaves * leaves < 2 * fall * kUnseenHop * size_of(*c.force, before);
  }
  if (!dies) return false;
  c.died_at.push_back(before.t);
  // The hops of 2 v/a, their speeds v each e times the one before.
  const double e = number(c, c.contact->restitution_number());
  if (e < 1) c.unseen = {before.t, 2 * e * approach / (fall * (1 - e))};
  return true;
}

double MotionEvents::unseen_bounces(double t) const {
  double longest = 0;
  for (const ContactOf& c : contacts_)
    if (c.unseen.since == t) longest = std::max(longest, c.unseen.lasts_s);
  return longest;
}

void MotionEvents::solve_unseen(const StateView& behind, std::vector<double>& z, std::vector<double>& x) {
  z.assign(behind.z, behind.z + assembly_.nz());
  for (const ContactOf& c : contacts_) {
    if (c.unseen.since != behind.t) continue;
    z[static_cast<std::size_t>(c.closed_state)] = 0;
    if (c.sliding_state >= 0) z[static_cast<std::size_t>(c.sliding_state)] = 0;
    if (slides_in_space(c)) clear_slip(c.sliding_state, z.data());
  }
  StateView open = behind;
  open.z = z.data();
  x.resize(static_cast<std::size_t>(assembly_.n() + assembly_.m()));
  solve_motion(open, x.data());
}

void MotionEvents::strike(int event, const StateView& before) {
  ContactOf& own = contacts_[static_cast<std::size_t>(of(event).contact)];
  const bool halts = contact_guard(event) != UnilateralForce::Guard::touch;
  open_z_.assign(before.z, before.z + assembly_.nz());
  for (ContactOf& c : contacts_) {
    c.closed = false;
    c.slides = 0;
    if (c.closed_state >= 0) open_z_[static_cast<std::size_t>(c.closed_state)] = 0;
  }
  StateView open = before;
  open.z = open_z_.data();
  if (halts) {
    // Sliding in space ends, or begins: what speed there is along the ground goes to zero; that of others stays.
    const std::vector<char> stops = stopping(event, before);
    std::vector<ImpactRow> held;
    std::vector<ActiveRow> all;
    for (const ContactOf& c : contacts_) {
      if (c.closed_state < 0 || before.z[c.closed_state] < 0.5) continue;
      const bool own_way = stops[static_cast<std::size_t>(&c - contacts_.data())] != 0,
                 along = own_way || (c.sliding_state >= 0 && std::abs(before.z[c.sliding_state]) < 0.5);
      for (int r = 0; r < (along ? c.contact->row_count() : 1); ++r) {
        all.push_back({static_cast<int>(held.size()), ActiveRow::Law::held, 0, 0});
        held.push_back({c.force, c.contact, r, false, !own_way || r == 0});
      }
    }
    impact_->prepare(open, held);
    impact_->solve(all);
    jump_.assign(impact_->u(), impact_->u() + assembly_.n());
    expands_ = false;
    return;
  }
  const double speed = -row_of(*own.force, *own.contact, 0, before, assembly_, nullptr).c1;
  own.largest_approach = std::max(own.largest_approach, speed);
  std::vector<InPlay> in_play = find_in_play(event, before, speed);
  const bool poisson = std::any_of(in_play.begin(), in_play.end(), [](const InPlay& c) {
    return c.bounces && c.contact->contact->gives_impulse_back();
  });
  std::vector<ImpactRow> rows;
  for (InPlay& c : in_play)
    for (int r = 0; r < c.contact->contact->row_count(); ++r) {
      c.rows.push_back(static_cast<int>(rows.size()));
      const bool closed = c.contact->closed_state >= 0 && before.z[c.contact->closed_state] > 0.5;
      rows.push_back({c.contact->force, c.contact->contact, r, c.bounces && r == 0 && !poisson,
                      closed && (r == 0 || c.way == kSticks)});
    }
  std::vector<double> restitution;
  for (InPlay& c : in_play) restitution.push_back(poisson ? std::exchange(c.restitution, 0.0) : c.restitution);
  impact_->prepare(open, rows);
  find_way(event, before, *impact_, in_play, speed);
  const auto n = static_cast<std::size_t>(assembly_.n());
  jump_.assign(impact_->u(), impact_->u() + n);
  double lost = impact_->energy_lost(), scale = impact_->energy_scale();
  expands_ = poisson;
  if (poisson) {
    for (std::size_t c = 0; c < in_play.size(); ++c)
      in_play[c].given = restitution[c] * impact_->impulse(in_play[c].rows.front());
    compressed_.assign(before.v, before.v + n);
    for (std::size_t i = 0; i < n; ++i) compressed_[i] += jump_[i];
    open.v = compressed_.data();
    for (const ActiveRow& a : impact_->active())
      rows[static_cast<std::size_t>(a.row)].rests = a.law == ActiveRow::Law::held;
    for (const InPlay& c : in_play) {
      if (c.way == kOpen)
        for (const int row : c.rows) rows[static_cast<std::size_t>(row)].rests = false;
      if (slides(c.way) != 0)
        for (std::size_t r = 1; r < c.rows.size(); ++r) rows[static_cast<std::size_t>(c.rows[r])].rests = false;
    }
    expansion_->prepare(open, rows);
    find_way(event, before, *expansion_, in_play, speed);
    for (std::size_t i = 0; i < n; ++i) jump_[i] += expansion_->u()[i];
    lost += expansion_->energy_lost();
    scale += expansion_->energy_scale();
  }
  last_loss_ = lost;
  if (lost < -kContactRounding * scale)
    throw SolverError(
        fmt::format("At t = {:.9g} s the impact of '{}' at {:.3g} m/s would create an energy of {:.3g} J: {}", before.t,
                    of(event).name, speed, -lost,
                    poisson ? "Poisson's law with these restitutions does. Take equal ones, or kind = \"compliant\"."
                            : "Newton's law of restitution does that with friction, or with several contacts. Give the "
                              "contacts restitution_law = \"poisson\"."));
  for (const InPlay& c : in_play)  // of the first time in a run
    if (c.contact->closed_state >= 0 && !c.contact->died_at.empty() && c.contact->died_at.front() == before.t)
      notice(fmt::format(
          "At t = {:.9g} s the bounces of {} have died out, infinitely many of them: with {:.3g} m/s (once {:.3g}) it "
          "closes. It takes {:.3g} J.",
          before.t, c.contact->force->path(), speed, c.contact->largest_approach, lost));
  // In the plane what slides does so the way that it is left with, which is not what it was where the last impact holds
  // it down, and what has no speed that could be told from errors sticks, if it can: of corners of one body one could
  // as well slide at no speed against another one, or against a wall that the body has come to rest at, which then
  // holds the friction of both, at its limit where both bear as much.
  const Impact& last = expands_ ? *expansion_ : *impact_;
  for (const InPlay& c : in_play) {
    c.contact->closed = c.contact->closed_state >= 0 && !c.bounces && c.way != kOpen;
    c.contact->slides = c.contact->closed ? slides(c.way) : 0;
    if (c.contact->slides == 0 || c.rows.size() < 2) continue;
    const double along = last.speed_after(c.rows[1]), across = c.rows.size() > 2 ? last.speed_after(c.rows[2]) : 0,
                 none = std::max(kContactRounding * speed, velocity_error());
    c.contact->slides = std::hypot(along, across) <= none ? 0 : along > 0 || c.rows.size() > 2 ? 1 : -1;
  }
}

}  // namespace costate
