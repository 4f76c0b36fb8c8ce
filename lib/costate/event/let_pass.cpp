// Guards that are looked at under a condition: a foot touches only where it is ahead of the other one. Within a look
// the condition comes or ceases at one place, and on the side where it holds the guard crosses zero or not. Straight
// legs of one length that pass each other are both at the ground there (let_pass.h); of others errors decide where both
// conditions nearly meet, and that is kept to be told.
#include "costate/event/let_pass.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/event/contact_gap.h"
#include "costate/event/motion_events.h"

namespace costate {

double MotionEvents::errors_of_meeting() const {
  constexpr double kErrors = 10;  // in rtol of the coordinates
  return std::max(kAtGround, kErrors * slip_error_.relative) * reach_;
}

void MotionEvents::meet_condition(GuardOf& g, bool comes, double& a, double& b, double& at_end,
                                  const std::function<StateView(double)>& at) {
  const int direction = g.guarded->guard_direction(g.k);
  // The last place without the condition and the first one with it, or the other way round.
  double from = a, to = b;
  for (int k = 0; k < 200 && to - from > 2 * std::numeric_limits<double>::epsilon() * std::abs(to); ++k) {
    const double m = 0.5 * (from + to);
    if (!(from < m && m < to)) break;
    (std::isnan(value(g, at(m))) == comes ? from : to) = m;
  }
  const double where = comes ? to : from;
  const StateView s = at(where);
  const double there = value(g, s), size = std::max(reach_, largest_coordinate(*g.force, s));
  // Legs alike are above the ground, or below it, by as much as the one that stands: no error decides.
  const bool alike = meets_alike(*g.force, *g.guarded, g.k, s, assembly_, there, errors_of_meeting());
  const double errors = alike ? errors_of_meeting() : 0;
  if (!alike && (!nearest_pass_ || std::abs(there) * nearest_pass_->size < std::abs(nearest_pass_->gap) * size))
    nearest_pass_ = Pass{where, g.name, there, size};
  if (comes && there * direction < -errors) {  // what comes ahead past the ground is let pass
    g.ready = true;
    a = where;
  } else if (!comes && g.ready && there * direction > errors) {
    b = where;
    at_end = there;
  }
}

}  // namespace costate
