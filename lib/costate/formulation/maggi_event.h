// The mechanism's events (event/motion_events.h) in independent coordinates: y goes on, yd but for impacts, force
// states jump. All work at the linearized point of the level before the event, in the chart in force.
#pragma once

#include "costate/event/motion_events.h"
#include "costate/level/maggi_level.h"

namespace costate {

/// (yd, z) behind the event.
void cross_event(MaggiLevel& level, MotionEvents& events, int event, double* yd, double* z);
/// Columns (dy, dyd, dz), one a parameter, before the event become those behind it; dcost as MotionEvents::tangent().
void cross_event_tangent(MaggiLevel& level, MotionEvents& events, int event, const MotionEvents::Side& minus,
                         const MotionEvents::Side& plus, double* const* s, int count, double* dcost);
/// Adjoints (mu_y, mu_yd, mu_z) behind the event become weights of (q, v, z) before it, which the level then pulls
/// back; the gradient gains the event's own share.
void cross_event_adjoint(MaggiLevel& level, MotionEvents& events, int event, const MotionEvents::Side& minus,
                         const MotionEvents::Side& plus, const double* mu, ScalarGradient& weights, double* gradient);

}  // namespace costate
