// How fast a point moves at most with the speeds of what it is on, whatever way that is turned.
#pragma once

#include <cmath>

#include "costate/element/point/planar_point.h"
#include "costate/element/point/spatial_point.h"

namespace costate {

struct PointSpeed {
  double travel = 0;  // of its body's origin, m/s; of a point on none its own
  double lever = 0;   // its distance from there, m
  double turn = 0;    // of the body, rad/s; 0 without a lever
  double most() const { return travel + lever * turn; }
};

/// v: the point's own velocities; p: its numbers.
inline PointSpeed point_speed(const PlanarPoint& point, const double* q, const double* v, const double* p) {
  if (point.kind() == PlanarPoint::Kind::on_body) {
    const double lever = std::sqrt(p[0] * p[0] + p[1] * p[1]);
    return {std::sqrt(v[0] * v[0] + v[1] * v[1]), lever, lever > 0 ? std::abs(v[2]) : 0};
  }
  double x, y;
  point.velocity(q, v, p, x, y);
  return {std::sqrt(x * x + y * y)};
}

inline PointSpeed point_speed(const SpatialPoint& point, const double* q, const double* v, const double* p) {
  const auto length = [](const double* x) { return std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); };
  if (point.kind() == SpatialPoint::Kind::on_body) {
    // omega = 2 E edot, |E| = 1
    const double lever = length(p);
    return {length(v), lever, lever > 0 ? 2 * std::sqrt(v[3] * v[3] + v[4] * v[4] + v[5] * v[5] + v[6] * v[6]) : 0};
  }
  double r[3];
  point.velocity(q, v, p, r);
  return {length(r)};
}

}  // namespace costate
