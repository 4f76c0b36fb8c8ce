// The mechanism's events (event/motion_events.h) in independent coordinates: y goes on, yd but for impacts, force
// states jump. Where rows come and go (level/maggi_rows.h) another chart comes into force: y and yd are those of q and
// v in it. All work at the linearized point of the level before the event, in the chart in force there.
#pragma once

#include "costate/analysis/start.h"
#include "costate/event/motion_events.h"
#include "costate/level/maggi_level.h"

namespace costate {

// (y, yd) in the chart in force, with places, of (t, q, v, z): values, columns and weights.
void read_coordinates(MaggiLevel& level, const StateView& s, double* y);
void push_coordinates(MaggiLevel& level, const StateView& s, const double* const* dq, const double* const* dv,
                      double* const* out, int count);
/// Columns (dy, dyd, dz) of a start with its derivative.
void push_start(MaggiLevel& level, const Start& start, double t, Eigen::MatrixXd& y_rho);
/// w_q and w_v (n each) += what weights mu of (y, yd) are of q and v; the gradient gains what places depend on.
void pull_coordinates(MaggiLevel& level, const StateView& s, const double* mu, double* w_q, double* w_v,
                      double* gradient);

/// The weights w (2 n + nz) of (q, v, z) as a gradient by these alone.
ScalarGradient weights_of(const Assembly& assembly, const double* w);

/// mu of (y, yd, z) becomes what `pull` makes of it, and of places, which go on across a jump, also what it was.
template <class Pull>
void keep_places(const MaggiLevel& level, double* mu, const Pull& pull) {
  const std::size_t first = level.independent().size();
  const std::vector<double> places(mu + first, mu + level.freedoms());
  pull();
  for (std::size_t k = 0; k < places.size(); ++k) mu[first + k] += places[k];
}

/// (y, yd, z), one behind the other, behind the event, and the chart there: the given one, unless it is to be found.
void cross_event(MaggiLevel& level, MotionEvents& events, int event, double* y, int chart = -1);
/// Columns (dy, dyd, dz), one a parameter, before the event become those behind it, in `chart`, which comes into force
/// with the states z_after; dcost as MotionEvents::tangent().
void cross_event_tangent(MaggiLevel& level, MotionEvents& events, int event, const MotionEvents::Side& minus,
                         const MotionEvents::Side& plus, int chart, const double* z_after, double* const* s, int count,
                         double* dcost);
/// Adjoints (mu_y, mu_yd, mu_z) behind the event, in `chart` and with the states z_after, become weights of (q, v, z)
/// before it, which the level then pulls back; the gradient gains the event's own share.
void cross_event_adjoint(MaggiLevel& level, MotionEvents& events, int event, const MotionEvents::Side& minus,
                         const MotionEvents::Side& plus, int chart, const double* z_after, const double* mu,
                         ScalarGradient& weights, double* gradient);

}  // namespace costate
