// Which rigid contacts are closed behind an impact, and behind any event: of all ways that there are the one in which
// the ground pushes where contacts are closed, nothing falls into it where they are open, and friction does not exceed
// its limit (lib/README.md (19)). There are few contacts: they are gone through.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/event/contact_gap.h"
#include "costate/event/motion_events.h"

namespace costate {

namespace {
// A bounce this much slower than the fastest one before: bounces that die out, infinitely many in finite time.
constexpr double kDiesOut = 1e-6;
// And where that is said beside another cause.
constexpr double kDying = 1e-3;
// Impulses, speeds, forces and accelerations of this part of the largest ones in play are rounding.
constexpr double kRounding = 1e-9;
// More contacts at once are not gone through: 2^n ways.
constexpr std::size_t kMostContacts = 12;

bool way_has(std::size_t way, std::size_t contact) { return way >> contact & 1; }
}  // namespace

void MotionEvents::cross_contact(int event, const StateView& before, double* v, double* z) {
  const GuardOf& g = of(event);
  const ContactOf* contact = contact_of(event);
  const bool touch = contact_of(event, true) != nullptr;
  const std::vector<double> states(before.z, before.z + assembly_.nz());
  std::vector<double> after = states;
  std::vector<char> together(contacts_.size(), 0);  // strikes in the same instant; v may be that of `before`
  if (touch) {
    strike(event, before);
    for (std::size_t c = 0; c < contacts_.size(); ++c)
      together[c] = strikes_too(contacts_[c], before, assembly_, -impact_->speed_before(0)) > 0;
    for (int i = 0; i < assembly_.n(); ++i) v[i] = before.v[i] + impact_->u()[i];
    last_jump_ = impact_->speed_after(0) - impact_->speed_before(0);
    last_loss_ = impact_->energy_lost();
    for (const ContactOf& c : contacts_)
      if (c.closed_state >= 0) after[static_cast<std::size_t>(c.closed_state)] = c.closed ? 1 : 0;
  } else {
    for (int i = 0; i < assembly_.n(); ++i) v[i] = before.v[i];
    after[static_cast<std::size_t>(contact->closed_state)] = 0;
  }
  if (contact->contact->guard_kind(g.k) == UnilateralForce::Guard::slip)
    throw CapabilityError(
        fmt::format("At t = {:.9g} s {} begins to slip, which is not there yet for rigid contact. Take "
                    "more friction, or kind = \"compliant\".",
                    before.t, contact->force->path()));
  StateView behind = before;
  behind.v = v;
  settle(behind, after.data(), g.name);
  std::copy(after.begin(), after.end(), z);
  for (GuardOf& other : guards_) {
    if (other.contact < 0) continue;
    const ContactOf& its = contacts_[static_cast<std::size_t>(other.contact)];
    const auto state = static_cast<std::size_t>(std::max(its.closed_state, 0));
    const bool was = its.closed_state >= 0 && states[state] > 0.5, is = its.closed_state >= 0 && after[state] > 0.5;
    if (its.contact->guard_kind(other.k) != UnilateralForce::Guard::touch)
      other.ready = is;
    else if (!is && (was || &its == contact || together[static_cast<std::size_t>(other.contact)])) {
      other.ready = false;
      other.just_left = true;
    }
  }
  const bool closed = contact->closed_state >= 0 && after[static_cast<std::size_t>(contact->closed_state)] > 0.5;
  last_mode_ = closed                                                                  ? "closed"
               : touch && number(*contact, contact->contact->restitution_number()) > 0 ? "bounces"
                                                                                       : "open";
}

void MotionEvents::strike(int event, const StateView& before) {
  ContactOf& own = contacts_[static_cast<std::size_t>(of(event).contact)];
  open_z_.assign(before.z, before.z + assembly_.nz());
  for (const ContactOf& c : contacts_)
    if (c.closed_state >= 0) open_z_[static_cast<std::size_t>(c.closed_state)] = 0;
  StateView open = before;
  open.z = open_z_.data();
  Taylor2 gap;
  gap_of(*own.force, *own.contact, before, assembly_, nullptr, &gap);
  const double speed = -gap.c1;
  own.largest_approach = std::max(own.largest_approach, speed);
  // Whether a contact that strikes with this approach speed bounces; if not it closes.
  const auto bounces_off = [&](const ContactOf& c, double approach) {
    if (!(number(c, c.contact->restitution_number()) > 0)) return false;
    if (c.closed_state >= 0) {
      if (approach < number(c, c.contact->closing_speed_number())) return false;
    } else if (approach < kDiesOut * c.largest_approach) {
      throw SolverError(fmt::format(
          "At t = {:.9g} s '{}' has an approach speed of {:.3g} m/s, where it once had {:.3g}: its bounces die out, "
          "infinitely many of them. Give '{}.closing_speed_m_per_s', below which it closes, or end the run before.",
          before.t, of(event).name, approach, c.largest_approach, c.force->path()));
    }
    if (c.contact->row_count() > 1)
      throw CapabilityError(
          fmt::format("At t = {:.9g} s {} bounces with friction, which is not there yet: friction is for "
                      "contacts that stick (restitution 0). Take friction = \"none\", or kind = \"compliant\".",
                      before.t, c.force->path()));
    return true;
  };
  // The contacts in play: that of the event, those that strike in the same instant, those that are closed.
  struct InPlay {
    ContactOf* contact;
    bool strikes, bounces;
    double restitution;
  };
  std::vector<InPlay> in_play;
  const auto strikes = [&](ContactOf& c, double approach) {
    const bool bounces = bounces_off(c, approach);
    in_play.push_back({&c, true, bounces, bounces ? number(c, c.contact->restitution_number()) : 0});
  };
  strikes(own, speed);
  for (ContactOf& c : contacts_) {
    c.closed = false;
    if (&c == &own) continue;
    if (c.closed_state >= 0 && before.z[c.closed_state] > 0.5) {
      in_play.push_back({&c, false, false, 0});
    } else if (const double approach = strikes_too(c, before, assembly_, speed); approach > 0) {
      c.largest_approach = std::max(c.largest_approach, approach);
      strikes(c, approach);
    }
  }
  if (in_play.size() > kMostContacts)
    throw CapabilityError(fmt::format("{} contacts are closed at an impact of '{}': at most {} are gone through.",
                                      in_play.size(), of(event).name, kMostContacts));
  std::vector<ImpactRow> rows;
  std::vector<std::vector<int>> rows_of(in_play.size());
  for (std::size_t c = 0; c < in_play.size(); ++c)
    for (int r = 0; r < in_play[c].contact->contact->row_count(); ++r) {
      rows_of[c].push_back(static_cast<int>(rows.size()));
      rows.push_back({in_play[c].contact->force, in_play[c].contact->contact, r, in_play[c].bounces});
    }
  impact_->prepare(open, rows);
  // All ways to close them, those first in which most stay as they are.
  const std::size_t ways = std::size_t{1} << in_play.size();
  std::vector<std::size_t> order(ways);
  for (std::size_t w = 0; w < ways; ++w) order[w] = w;
  const auto opened = [&](std::size_t w) {
    int n = 0;
    for (std::size_t c = 0; c < in_play.size(); ++c) n += !way_has(w, c);
    return n;
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return opened(a) < opened(b); });
  std::vector<double> found;
  std::size_t chosen = 0;
  std::string slips;
  for (const std::size_t way : order) {
    std::vector<int> active;
    for (std::size_t c = 0; c < in_play.size(); ++c)
      if (way_has(way, c)) active.insert(active.end(), rows_of[c].begin(), rows_of[c].end());
    impact_->solve(active);
    double largest = 0;
    for (const int i : active) largest = std::max(largest, std::abs(impact_->impulse(i)));
    if (!std::isfinite(largest)) continue;
    bool fits = true;
    for (std::size_t c = 0; c < in_play.size() && fits; ++c) {
      const int normal = rows_of[c].front();
      for (const int i : rows_of[c])  // rows that depend on each other may have no common solution
        if (way_has(way, c) && !in_play[c].bounces) fits = fits && std::abs(impact_->speed_after(i)) <= 1e-6 * speed;
      if (!way_has(way, c)) {
        fits = fits && impact_->speed_after(normal) >=
                           -in_play[c].restitution * impact_->speed_before(normal) - kRounding * speed;
        continue;
      }
      fits = fits && impact_->impulse(normal) >= -kRounding * largest;
      if (!fits || rows_of[c].size() < 2) continue;
      const double mu = number(*in_play[c].contact, in_play[c].contact->contact->friction_number());
      if (std::abs(impact_->impulse(rows_of[c][1])) > mu * impact_->impulse(normal) + kRounding * largest) {
        fits = false;
        slips = fmt::format("{} would need a friction coefficient of {:.3g}, and has {:.3g}",
                            in_play[c].contact->force->path(),
                            std::abs(impact_->impulse(rows_of[c][1])) / impact_->impulse(normal), mu);
      }
    }
    if (!fits) continue;
    std::vector<double> u(impact_->u(), impact_->u() + assembly_.n());
    if (found.empty()) {
      found = u;
      chosen = way;
      continue;
    }
    double size = 0, apart = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
      size = std::max({size, std::abs(u[i]), std::abs(found[i])});
      apart = std::max(apart, std::abs(u[i] - found[i]));
    }
    if (apart > 1e-6 * size)
      throw SolverError(
          fmt::format("At t = {:.9g} s the impact of '{}' has several solutions, in which other contacts "
                      "stay closed: the laws of rigid bodies do not choose between them. Take kind = "
                      "\"compliant\".",
                      before.t, of(event).name));
  }
  if (found.empty())
    throw CapabilityError(
        slips.empty()
            ? fmt::format(
                  "At t = {:.9g} s the impact of '{}' at {:.3g} m/s has no solution.{}", before.t, of(event).name,
                  speed,
                  speed < kDying * own.largest_approach
                      ? fmt::format(" It once had {:.3g} m/s: impacts die out, infinitely many of them; end the "
                                    "run before.",
                                    own.largest_approach)
                      : "")
            : fmt::format(
                  "At t = {:.9g} s a contact slips in the impact of '{}', which is not there yet: {}. Take more "
                  "friction, or kind = \"compliant\".",
                  before.t, of(event).name, slips));
  std::vector<int> active;
  for (std::size_t c = 0; c < in_play.size(); ++c) {
    if (!way_has(chosen, c)) continue;
    active.insert(active.end(), rows_of[c].begin(), rows_of[c].end());
    in_play[c].contact->closed = in_play[c].contact->closed_state >= 0 && !in_play[c].bounces;
  }
  impact_->solve(active);
}

void MotionEvents::solve_motion(const StateView& s, double* x) {
  const auto n = static_cast<std::size_t>(assembly_.n()), m = static_cast<std::size_t>(assembly_.m());
  impact_->balance().prepare(s);
  std::copy_n(assembly_.Q.data(), n, x);
  for (std::size_t i = 0; i < m; ++i) x[n + i] = -assembly_.bias[i];
  impact_->balance().solve(x);
}

void MotionEvents::settle(const StateView& s, double* z, const std::string& event) {
  std::vector<const ContactOf*> closed;
  for (const ContactOf& c : contacts_)
    if (c.closed_state >= 0 && z[c.closed_state] > 0.5) closed.push_back(&c);
  if (closed.empty()) return;
  const auto n = static_cast<std::size_t>(assembly_.n()), m = static_cast<std::size_t>(assembly_.m());
  std::vector<double> x(n + m);
  const std::size_t ways = std::size_t{1} << closed.size();
  std::string slips;
  for (std::size_t way = ways; way-- > 0;) {  // all closed first
    for (std::size_t c = 0; c < closed.size(); ++c) z[closed[c]->closed_state] = way_has(way, c) ? 1 : 0;
    StateView at = s;
    at.z = z;
    solve_motion(at, x.data());
    double largest = 0;
    for (std::size_t i = 0; i < m; ++i) largest = std::max(largest, std::abs(x[n + i]));
    bool fits = true;
    for (std::size_t c = 0; c < closed.size() && fits; ++c) {
      const double* lambda = x.data() + n + closed[c]->first_row;
      if (!way_has(way, c)) {
        Taylor2 gap;
        gap_of(*closed[c]->force, *closed[c]->contact, s, assembly_, x.data(), &gap);
        double scale = 0;
        for (std::size_t i = 0; i < n; ++i) scale = std::max(scale, std::abs(x[i]));
        fits = gap.c2 >= -kRounding * scale;
        continue;
      }
      fits = -lambda[0] >= -kRounding * largest;
      if (!fits || closed[c]->contact->row_count() < 2) continue;
      const double mu = number(*closed[c], closed[c]->contact->friction_number());
      if (std::abs(lambda[1]) > -mu * lambda[0] + kRounding * largest) {
        fits = false;
        slips = fmt::format("{} would need a friction coefficient of {:.3g}, and has {:.3g}", closed[c]->force->path(),
                            std::abs(lambda[1] / lambda[0]), mu);
      }
    }
    if (fits) return;
  }
  throw CapabilityError(
      slips.empty()
          ? fmt::format("At t = {:.9g} s, behind '{}', no way to close the contacts that touch is a solution.", s.t,
                        event)
          : fmt::format(
                "At t = {:.9g} s, behind '{}', a contact slips, which is not there yet: {}. Take more friction, or "
                "kind = \"compliant\".",
                s.t, event, slips));
}

}  // namespace costate
