// Impacts of rigid contacts (lib/README.md (19)): of all ways that the contacts in play have, open, sticking or
// sliding, the one in which the ground pushes where they are closed, nothing moves into it where they are open, and
// friction neither exceeds its limit nor pushes along. Newton's law gives speeds back; Poisson's is two impacts, a
// compression without restitution and an expansion with the share of its impulses.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/event/contact_gap.h"
#include "costate/event/contact_ways.h"
#include "costate/event/motion_events.h"
#include "costate/event/slip_search.h"
#include "costate/event/spatial_slip.h"

namespace costate {

namespace {
// A bounce this much slower than the fastest one before: bounces that die out, infinitely many in finite time.
constexpr double kDiesOut = 1e-6;
// So is one that lifts by less than this part of the coordinates: looks at a gap find less of it than kGapRounding.
constexpr double kUnseenHop = 4 * kGapRounding;
// And where that is said beside another cause.
constexpr double kDying = 1e-3;
// What leaves more slowly than this part of the largest speed so far lifts by less than a touch is seen from.
constexpr double kHardly = 3e-5;
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
  if (dies && !(approach < (c.closed_state < 0 ? kDiesOut : kHardly) * c.largest_approach)) {
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
  // it down, and what has no speed sticks, if it can: of corners of one body one could as well slide at no speed
  // against another one, which then holds the friction of both, at its limit where both bear as much.
  const Impact& last = expands_ ? *expansion_ : *impact_;
  for (const InPlay& c : in_play) {
    c.contact->closed = c.contact->closed_state >= 0 && !c.bounces && c.way != kOpen;
    c.contact->slides = c.contact->closed ? slides(c.way) : 0;
    if (c.contact->slides == 0 || c.rows.size() != 2) continue;
    const double along = last.speed_after(c.rows[1]);
    c.contact->slides = std::abs(along) <= kContactRounding * speed ? 0 : along > 0 ? 1 : -1;
  }
}

void MotionEvents::find_way(int event, const StateView& before, Impact& impact, std::vector<InPlay>& in_play,
                            double speed) {
  std::vector<std::vector<int>> options;  // the way that a contact has now, and then those in which it stays closed
  for (const InPlay& c : in_play) {
    std::vector<int> o;
    const auto slide = [&](int forward, int backward) {
      if (c.rows.size() > 1) o.push_back(forward);
      if (c.rows.size() == 2) o.push_back(backward);  // in space it slides along its direction
    };
    if (c.given > 0) o = {kGivenSticks};
    if (c.given > 0) slide(kGivenForward, kGivenBackward);
    o.push_back(kSticks);
    slide(kForward, kBackward);
    if (!(c.given > 0)) o.push_back(kOpen);
    if (!(c.given > 0) && !is_given(c.way) && c.way != kOpen) {
      o.erase(std::find(o.begin(), o.end(), c.way));
      o.insert(o.begin(), c.way);
    }
    options.push_back(std::move(o));
  }
  // Behind the impact; what rests before it has no speed but drift.
  const auto speed_after = [&](int i) {
    return impact.speed_after(i) - (impact.row(i).rests ? impact.speed_before(i) : 0);
  };
  double fastest = speed;
  for (const InPlay& c : in_play)
    for (const int i : c.rows) fastest = std::max(fastest, std::abs(impact.speed_before(i)));
  // In space the directions in which contacts may slide are solved for.
  std::vector<SlidingContact> sliding;
  Eigen::VectorXd rates(impact.response().rows());
  for (Eigen::Index i = 0; i < rates.size(); ++i) rates[i] = impact.speed_before(static_cast<int>(i));
  for (const InPlay& c : in_play) {
    SlidingContact s;
    s.rows = c.rows;
    s.friction = number(*c.contact, c.contact->contact->friction_number());
    for (std::size_t k = 1; k < c.rows.size(); ++k) s.along[k - 1] = impact.change_of_gap(c.rows[k]);
    s.given = c.given > 0;
    s.normal = s.given ? c.given : impact.change_of_gap(c.rows.front());
    sliding.push_back(s);
  }
  std::optional<SlipSearch> search;
  const auto in_space = std::count_if(sliding.begin(), sliding.end(), [](const auto& c) { return c.rows.size() > 2; });
  if (in_space > 0) search.emplace(impact.response(), rates, std::move(sliding));
  if (in_space > kMostInSpace && !search->proven())
    throw CapabilityError(
        fmt::format("At t = {:.9g} s {} contacts with friction in space take part in the impact of '{}': more than {} "
                    "are not gone through, unless their masses tell that there is one solution. Take friction = "
                    "\"none\" for some, or kind = \"compliant\".",
                    before.t, in_space, of(event).name, kMostInSpace));
  const auto slips = [&](const std::vector<int>& ways) -> std::vector<Slips> {
    if (!search) return {Slips(in_play.size(), Eigen::Vector2d::Zero())};
    for (std::size_t c = 0; c < in_play.size(); ++c) {
      const bool given = is_given(ways[c]);
      search->take(c, ways[c], given, given ? in_play[c].given : impact.change_of_gap(in_play[c].rows.front()));
    }
    return search->slips();
  };
  const auto rows_of = [&](const std::vector<int>& ways, const Slips& slip) {
    std::vector<ActiveRow> active;
    for (std::size_t c = 0; c < in_play.size(); ++c) {
      if (ways[c] == kOpen) continue;
      using Law = ActiveRow::Law;
      const auto& rows = in_play[c].rows;
      active.push_back(
          {rows.front(), is_given(ways[c]) ? Law::given : Law::held, 0, is_given(ways[c]) ? in_play[c].given : 0});
      const int direction = slides(ways[c]);
      const Law law = direction == 0 ? Law::held : Law::slides;
      if (rows.size() == 2) active.push_back({rows[1], law, static_cast<double>(direction), 0});
      if (rows.size() == 3)
        for (int k = 0; k < 2; ++k)
          active.push_back({rows[static_cast<std::size_t>(k + 1)], law, slip[c][k], 0, direction == 0 ? 0 : k + 1});
    }
    return active;
  };
  const auto fits = [&](const std::vector<int>& ways, const Slips& slip) {
    // Of rows that depend on each other impulses are some of many.
    const auto pushed = [&] {
      return search && search->has_impulses_for([&](int i) { return impact.speed_after(i); }, kSameMotion * fastest);
    };
    double largest = 0;
    for (const ActiveRow& a : impact.active()) {
      largest = std::max(largest, std::abs(impact.impulse(a.row)));
      if (!std::isfinite(impact.impulse(a.row))) return false;
      // Rows that depend on each other may have no common solution.
      if (a.law == ActiveRow::Law::held && impact.misses(a.row) > kSameMotion * fastest) return false;
    }
    for (std::size_t c = 0; c < in_play.size(); ++c) {
      const InPlay& at = in_play[c];
      const int normal = at.rows.front();
      if (ways[c] == kOpen || is_given(ways[c])) {
        const double least = is_given(ways[c]) ? 0 : -at.restitution * impact.speed_before(normal);
        if (speed_after(normal) < least - kContactRounding * fastest) return false;
        if (ways[c] == kOpen) continue;
      }
      if (impact.impulse(normal) < at.given - kContactRounding * largest && !pushed()) return false;
      if (at.rows.size() < 2) continue;
      const bool space = at.rows.size() == 3;
      if (const int direction = slides(ways[c]); direction != 0) {
        const double along = space ? slip[c][0] * speed_after(at.rows[1]) + slip[c][1] * speed_after(at.rows[2])
                                   : direction * speed_after(at.rows[1]);
        if (along < -kContactRounding * fastest) return false;
      } else if (std::hypot(impact.impulse(at.rows[1]), space ? impact.impulse(at.rows[2]) : 0) >
                     number(*at.contact, at.contact->contact->friction_number()) * impact.impulse(normal) +
                         kContactRounding * largest &&
                 !pushed()) {
        return false;
      }
    }
    return true;
  };
  std::vector<double> found;
  std::vector<int> chosen;
  Slips chosen_slip;
  std::vector<std::size_t> lifted;
  const auto names = [&] {
    std::vector<std::string> list;
    for (const InPlay& c : in_play) list.push_back(c.contact->force->path());
    return fmt::format("{}", fmt::join(list, ", "));
  };
  const auto look_at = [&](const std::vector<int>& ways, const Slips& slip) {
    impact.solve(rows_of(ways, slip));
    if (!fits(ways, slip)) return;
    const std::vector<double> u(impact.u(), impact.u() + assembly_.n());
    if (chosen.empty()) {
      found = u;
      chosen = ways;
      chosen_slip = slip;
      return;
    }
    // What a slow impact may do by less than speeds are told apart is one.
    if (!are_one_motion(found, u.data(), levers_, kSameMotion * std::max(fastest, fastest_)))
      throw SolverError(
          fmt::format("At t = {:.9g} s the impact of '{}' has several solutions, in which contacts ({}) do different "
                      "things: the laws of rigid bodies do not choose between them. Take kind = \"compliant\".",
                      before.t, of(event).name, names()));
  };
  const bool few = for_all_ways(options, [&](const std::vector<int>& ways) {
    if (search && search->proven() && !chosen.empty()) return;
    for (const Slips& slip : slips(ways)) look_at(ways, slip);
  });
  if (!few)
    throw CapabilityError(
        fmt::format("{} contacts are closed at an impact of '{}': that is more ways than are gone "
                    "through, {}.",
                    in_play.size(), of(event).name, kMostWays));
  if (chosen.empty()) {
    const ContactOf& own = contacts_[static_cast<std::size_t>(of(event).contact)];
    throw CapabilityError(fmt::format(
        "At t = {:.9g} s the impact of '{}' at {:.3g} m/s has no solution, whether contacts ({}) open, stick or "
        "slide{}.{}",
        before.t, of(event).name, speed, names(), search ? search->told() : "",
        speed < kDying * own.largest_approach
            ? fmt::format(" It once had {:.3g} m/s: impacts die out, infinitely many of them; end the run before.",
                          own.largest_approach)
            : ""));
  }
  if (search && !search->proven() && search->starts() > 0)
    notice(
        fmt::format("Behind impacts of contacts ({}) several may slide in space at once{}: one motion was found, and "
                    "that there is no other is not proven.",
                    names(), search->told()));
  impact.solve(rows_of(chosen, chosen_slip));
  // Contacts that strike in turn, ever more slowly, lift each other infinitely many times in finite time. What would
  // lift too little to be seen stays, as a plastic impact of all of them has it.
  for (std::size_t c = 0; c < in_play.size(); ++c) {
    const int normal = in_play[c].rows.front();
    if (chosen[c] == kOpen && impact.row(normal).rests && speed_after(normal) < kHardly * fastest_) lifted.push_back(c);
  }
  for (std::size_t c = 0; c < in_play.size(); ++c)
    if (std::find(lifted.begin(), lifted.end(), c) == lifted.end()) in_play[c].way = chosen[c];
  if (lifted.empty()) return;
  std::vector<ActiveRow> active = rows_of(chosen, chosen_slip);
  for (const std::size_t c : lifted)
    for (const int row : in_play[c].rows)  // friction of what slides is left out: it would push
      if (row == in_play[c].rows.front() || impact.row(row).rests) active.push_back({row, ActiveRow::Law::held, 0, 0});
  if (const double acceleration = acceleration_by_forces(before); acceleration > 0)
    for (const std::size_t c : lifted)
      in_play[c].contact->unseen = {before.t, 2 * std::abs(speed_after(in_play[c].rows.front())) / acceleration};
  impact.solve(active);
  const ContactOf& own = contacts_[static_cast<std::size_t>(of(event).contact)];
  notice(fmt::format(
      "At t = {:.9g} s impacts of contacts ({}) die out, infinitely many of them: after the last, at {:.3g} m/s (once "
      "{:.3g}), they stay closed. It takes {:.3g} J.",
      before.t, names(), speed, own.largest_approach, impact.energy_lost()));
}

}  // namespace costate
