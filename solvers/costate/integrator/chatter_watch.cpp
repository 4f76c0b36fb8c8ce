#include "costate/integrator/chatter_watch.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "costate/base/error.h"

namespace costate {

namespace {
// By how much, of the time that the last ones took, halves of them may differ; and how many events are too many.
constexpr double kEven = 0.02, kTooMany = 1e7;
constexpr std::size_t kNamed = 8;  // of the last ones
}  // namespace

std::string last_events(const std::vector<RunEvent>& events) {
  std::set<std::string> names;
  for (std::size_t k = events.size() - std::min(events.size(), kNamed); k < events.size(); ++k)
    names.insert(fmt::format("'{} {}'", events[k].name, events[k].mode));
  return fmt::format("{}", fmt::join(names, " and "));
}

void ChatterWatch::look(const std::vector<RunEvent>& events, double end) {
  const double t = events.back().t;
  times_[count_++ % times_.size()] = t;
  if (count_ <= kWindow) return;
  const double all = t - before(kWindow), later = t - before(kWindow / 2), earlier = all - later;
  if (!(all > 0) || !(std::abs(later - earlier) <= kEven * all)) return;
  const double left = static_cast<double>(kWindow) * (end - t) / all;
  if (!(left > kTooMany)) return;
  throw SolverError(fmt::format(
      "The run does not get beyond t = {:.9g} s: its last {} events, by {} in turn, took {:.2g} s, and the rest would "
      "take {:.1g} of them. Where that are rigid contacts of which none can stay closed or open, kind = \"compliant\" "
      "tells what they do.",
      t, kWindow, last_events(events), all, left));
}

}  // namespace costate
