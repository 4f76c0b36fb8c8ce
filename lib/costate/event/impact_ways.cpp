// The ways of an impact of rigid contacts (lib/README.md (19)), gone through: of those that contacts in play have,
// open, sticking or sliding, the one that the laws of contact allow.
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
// Where that impacts die out is said beside another cause.
constexpr double kDying = 1e-3;
}  // namespace

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
  const auto is_lifted = [&](std::size_t c) {
    const int normal = in_play[c].rows.front();
    return chosen[c] == kOpen && impact.row(normal).rests && speed_after(normal) < kHardlyLifts * fastest_;
  };
  std::vector<std::pair<std::size_t, double>> lifted;  // with their speeds
  for (std::size_t c = 0; c < in_play.size(); ++c)
    if (is_lifted(c))
      lifted.emplace_back(c, speed_after(in_play[c].rows.front()));
    else
      in_play[c].way = chosen[c];
  if (lifted.empty()) return;
  const double acceleration = acceleration_by_forces(before);
  std::vector<ActiveRow> without = rows_of(chosen, chosen_slip);  // the friction of what slides
  std::vector<std::string> held;
  double fastest_lift = 0;
  for (const auto& [c, lift] : lifted) {
    const auto& rows = in_play[c].rows;
    if (acceleration > 0) in_play[c].contact->unseen = {before.t, 2 * std::abs(lift) / acceleration};
    held.push_back(in_play[c].contact->force->path());
    fastest_lift = std::max(fastest_lift, lift);
    chosen[c] = kSticks;
    Eigen::Vector2d slip(0, 0);
    for (std::size_t k = 0; k < rows.size(); ++k)
      if (k == 0 || impact.row(rows[k]).rests)
        without.push_back({rows[k], ActiveRow::Law::held, 0, 0});
      else
        slip[static_cast<Eigen::Index>(k) - 1] = impact.speed_after(rows[k]);
    if (slip.norm() > 0) chosen[c] = rows.size() == 2 && slip[0] < 0 ? kBackward : kForward;
    chosen_slip[c] = slip.normalized();
  }
  // The pull that holds it is as much as falling back would give: the friction that goes with it on what slides pushes
  // by as much as follows too early, and what slides is slowed as it would be. Not where energy comes of it.
  impact.solve(rows_of(chosen, chosen_slip));
  if (impact.energy_lost() + (&impact == &*expansion_ ? impact_->energy_lost() : 0) < 0) impact.solve(without);
  double taken = 0;
  for (const auto& [c, lift] : lifted) taken += 0.5 * lift * std::abs(impact.impulse(in_play[c].rows.front()));
  notice(fmt::format(
      "At t = {:.9g} s the impact of '{}' at {:.3g} m/s would lift {} with {:.3g} m/s, {:.1g} of the largest speed so "
      "far, too little to be seen: {} closed, as where impacts die out, infinitely many of them. That takes {:.3g} J.",
      before.t, of(event).name, speed, fmt::join(held, " and "), fastest_lift, fastest_lift / fastest_,
      held.size() == 1 ? "it stays" : "they stay", taken));
}

}  // namespace costate
