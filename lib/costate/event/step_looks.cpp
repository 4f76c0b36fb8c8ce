// Where within a step guards are looked at, and slips that are too slow to be told from errors.
#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/event/contact_gap.h"
#include "costate/event/motion_events.h"
#include "costate/event/time_of_change.h"
#include "costate/event/unresolved_slip.h"

namespace costate {

namespace {
// Looks within a step at guards that are no gaps, or whose gap may close in it: what crosses and comes back between two
// of them is seen of gaps alone.
constexpr int kLooks = 4;
// So many times as fast another foot of the body goes on.
constexpr double kTurnsAbout = 3;
// Of a step, to which the time is found at which a slip falls below: the guard is |w|, whatever it is there.
constexpr double kOfSlowStep = 1e-9;
}  // namespace

std::optional<MotionEvents::Hit> MotionEvents::find_unresolved(double from, double to,
                                                               const std::function<StateView(double)>& at) {
  if (!(slip_error_.relative > 0)) return {};
  std::optional<Hit> first;
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    const GuardOf& g = guards_[i];
    const double slowest = slowest_slip(g);
    if (!g.ready || !(slowest > 0) || std::isnan(g.last)) continue;
    const UnresolvedSlip slip(g.largest_slip, slip_error_.relative, slip_error_.absolute);
    const double least = slip.least();
    const auto above = [&](double t) { return value(g, at(t)) + slowest > least; };
    if (above(to)) continue;
    // A foot about which the others of its body turn is slow, and does not stop for that.
    const auto& body = contacts_[static_cast<std::size_t>(g.contact)].force->coordinates();
    if (std::any_of(guards_.begin(), guards_.end(), [&](const GuardOf& other) {
          return &other != &g && slowest_slip(other) > 0 && !std::isnan(other.last) &&
                 contacts_[static_cast<std::size_t>(other.contact)].force->coordinates() == body &&
                 value(other, at(to)) + slowest_slip(other) > kTurnsAbout * least;
        }))
      continue;
    double a = from, b = to;
    halve_to_change(a, b, kOfSlowStep * (to - from), above);
    if (slip.yet() && slides_from_rest(static_cast<int>(i), at(b))) continue;
    if (!first || b < first->t) first = Hit{b, static_cast<int>(i)};
  }
  if (!first) return {};
  looked_until_ = std::numeric_limits<double>::quiet_NaN();
  guards_[static_cast<std::size_t>(first->event)].ready = false;
  return first;
}

void MotionEvents::choose_looks(double from, double to, const std::function<StateView(double)>& at) {
  looks_.clear();
  bool near = !(from == looked_until_);
  double size = 0;
  const StateView last = at(to);
  thread_local std::vector<GapTrace::Look> ends;  // of gaps that are looked at; the others' times are no numbers
  ends.assign(guards_.size(), {std::numeric_limits<double>::quiet_NaN(), {}});
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    GuardOf& g = guards_[i];
    if (!g.guarded->guard_armed(g.k, last.z + g.first_state)) continue;
    near = near || !g.gap || g.just_left;
    if (!g.gap) continue;
    ends[i] = g.gap->look(last, assembly_);
    near = near || g.seen.t != from || !stays_away(g.seen, ends[i]);
    // What is past and was not seen to come stays away on the wrong side.
    near = near || (!g.ready && ends[i].m.gap * g.guarded->guard_direction(g.k) > 0);
    size = std::max(size, size_of(*g.force, last));
  }
  reach_ = std::max(reach_, size);
  if (near) {
    for (int j = 0; j <= kLooks; ++j) looks_.push_back(j == kLooks ? to : from + (to - from) * j / kLooks);
    for (std::size_t i = 0; i < guards_.size(); ++i) {
      GuardOf& g = guards_[i];
      if (!(from < ends[i].t)) continue;
      if (g.seen.t != from) g.seen = g.gap->look(at(from), assembly_);
      if (stays_away(g.seen, ends[i])) continue;
      g.gap->follow(g.seen, ends[i], at, assembly_, trace_);
      for (std::size_t k = 1; k + 1 < trace_.size(); ++k)
        if ((trace_[k].m.gap < 0) != (trace_[k - 1].m.gap < 0) && std::abs(trace_[k].m.gap) > kGapRounding * size)
          looks_.push_back(trace_[k].t);
    }
    std::sort(looks_.begin(), looks_.end());
    looks_.erase(std::unique(looks_.begin(), looks_.end()), looks_.end());
  }
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    GuardOf& g = guards_[i];
    if (std::isnan(ends[i].t)) continue;
    g.seen = ends[i];
    if (!near && ends[i].m.gap * g.guarded->guard_direction(g.k) < 0) g.ready = true;
  }
  looked_until_ = to;
}

}  // namespace costate
