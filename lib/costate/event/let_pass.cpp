// Guards that are looked at under a condition: a foot touches only where it is ahead of the other one. Within a look
// the condition comes or ceases at one place, and on the side where it holds the guard crosses zero or not. Straight
// legs of one length that pass each other are both at the ground there and what comes there is let pass; of others
// errors decide where both conditions nearly meet, and that is kept to be told.
#include <algorithm>
#include <cmath>

#include "costate/element/conditional_guard.h"
#include "costate/event/contact_gap.h"
#include "costate/event/motion_events.h"
#include "costate/event/time_of_change.h"

namespace costate {

double MotionEvents::errors_of_meeting() const {
  constexpr double kErrors = 10;  // in rtol of the coordinates
  return std::max(kAtGround, kErrors * slip_error_.relative) * reach_;
}

bool MotionEvents::meets_alike(const GuardOf& g, const StateView& s, double value) {
  const auto* conditional = dynamic_cast<const ConditionalGuard*>(g.guarded);
  if (!conditional) return false;
  const ConditionalGuard::Other other = conditional->other(g.k, gathered_.of(*g.force, s, assembly_.numbers()));
  const double errors = errors_of_meeting();
  return std::abs(other.ahead) <= errors && std::abs(other.guard - value) <= errors;
}

void MotionEvents::meet_condition(GuardOf& g, bool comes, double& a, double& b, double& at_end,
                                  const std::function<StateView(double)>& at) {
  const int direction = g.guarded->guard_direction(g.k);
  // The last place without the condition and the first one with it, or the other way round.
  double from = a, to = b;
  halve_to_change(from, to, 0, [&](double t) { return std::isnan(value(g, at(t))) == comes; });
  const double where = comes ? to : from;
  const StateView s = at(where);
  const double there = value(g, s), size = std::max(reach_, size_of(*g.force, s));
  // Legs alike are above the ground, or below it, by as much as the one that stands: no error decides.
  const bool alike = meets_alike(g, s, there);
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
