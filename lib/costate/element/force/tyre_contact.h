// Where a wheel meets the ground. e_y is the wheel's axis, n the ground's normal, and, all normalised,
//   e_x = e_y x n (where the wheel points),  e_g = n x e_x (the axis projected on the ground),  e_z = e_x x
//   e_y.
// The contact point is the centre - r_w e_z: that of a disc with the ground's tangent plane. Slip belongs to
// the centre's velocity V; camber = atan(n.e_y / n.e_z).
#pragma once

#include <cmath>

#include "costate/element/force/road.h"
#include "costate/element/point/rotation.h"

namespace costate {

/// How the deflection and the normal force follow from the geometry. s is the ground's slope, z_p its height
/// below the centre, d = z_centre - z_p, H = sqrt(1 + s^2).
enum class TyreContact {
  /// The disc's lowest point against the tangent plane below it: deflection R - r_w, approach -V.n / (n.e_z).
  disc,
  /// As the public Iltis model does: deflection (R - d)/H, contact point centre - (d / (H^2 e_z,z)) e_z; with
  /// camber the
  /// deflection counts vertically and not along the disc.
  source,
  /// Deflection R - d; the normal force is vertical and acts at the wheel's centre.
  vertical,
};

/// All of the contact that forces and measures need; S as in the tyre's physics.
template <class S>
struct TyreGeometry {
  S ex[3], ey[3], eg[3], ez[3], n[3];
  S loaded_radius;         // r_w, m
  S deflection, approach;  // m, m/s: rate of the deflection as the damper sees it
  S forward, lateral;      // V.e_x, V.e_g, m/s
  S camber;                // rad
};

/// The wheel as the contact sees it. axis needs not be normalised.
template <class S>
struct WheelState {
  S x, z;  // of the centre
  S axis[3], velocity[3];
};

template <class S>
S length3(const S* a) {
  using std::sqrt;
  return sqrt(dot3(a, a));
}

template <class S>
void normalise3(S* a) {
  const S factor = S(1.0) / length3(a);
  for (int i = 0; i < 3; ++i) a[i] *= factor;
}

/// The directions for a level ground, n = (0, 0, 1).
template <class S>
void level_directions(const S* axis, TyreGeometry<S>& g) {
  using std::atan;
  using std::sqrt;
  const S factor = S(1.0) / length3(axis);
  for (int i = 0; i < 3; ++i) g.ey[i] = axis[i] * factor;
  const S flat = sqrt(g.ey[0] * g.ey[0] + g.ey[1] * g.ey[1]), turn = S(1.0) / flat;
  g.ex[0] = g.ey[1] * turn;
  g.ex[1] = -g.ey[0] * turn;
  g.ex[2] = g.eg[2] = g.n[0] = g.n[1] = S(0.0);
  g.eg[0] = -g.ex[1];
  g.eg[1] = g.ex[0];
  g.n[2] = S(1.0);
  g.ez[0] = g.ex[1] * g.ey[2];
  g.ez[1] = -g.ex[0] * g.ey[2];
  g.ez[2] = flat;
  g.camber = atan(g.ey[2] * turn);
}

template <class S>
void sloped_directions(const S* axis, const S& slope, TyreGeometry<S>& g) {
  using std::atan;
  using std::sqrt;
  g.n[2] = S(1.0) / sqrt(S(1.0) + slope * slope);
  g.n[0] = -slope * g.n[2];
  g.n[1] = S(0.0);
  for (int i = 0; i < 3; ++i) g.ey[i] = axis[i];
  normalise3(g.ey);
  cross3(g.ey, g.n, g.ex);
  normalise3(g.ex);
  cross3(g.n, g.ex, g.eg);  // normalised: n and e_x are, and perpendicular
  cross3(g.ex, g.ey, g.ez);
  g.camber = atan(dot3(g.n, g.ey) / dot3(g.n, g.ez));
}

/// factor, shift: the tyre's share of the road (Road::at); p: the road's numbers.
template <class S, class P>
void calc_tyre_geometry(const Road& road, TyreContact contact, const S& t, const WheelState<S>& w, const P& radius,
                        const P& factor, const P& shift, const P* p, TyreGeometry<S>& g) {
  using std::sqrt;
  const S* V = w.velocity;
  if (road.level()) {
    const RoadPoint<S> r = road.at(t, w.x, factor, shift, p);
    level_directions(w.axis, g);
    const S d = w.z - r.z;
    g.loaded_radius = d / g.ez[2];
    g.approach = r.rate - V[2];
    if (contact == TyreContact::disc) {
      g.deflection = S(radius) - g.loaded_radius;
      g.approach /= g.ez[2];
    } else {
      g.deflection = S(radius) - d;
    }
    g.forward = V[0] * g.ex[0] + V[1] * g.ex[1];
    g.lateral = V[0] * g.eg[0] + V[1] * g.eg[1];
    return;
  }
  S below = w.x;
  if (contact == TyreContact::disc) {  // below the lowest point of the unloaded disc
    level_directions(w.axis, g);
    below -= S(radius) * g.ez[0];
  }
  const RoadPoint<S> r = road.at(t, below, factor, shift, p);
  sloped_directions(w.axis, r.slope, g);
  if (contact == TyreContact::disc) {
    const S cosine = dot3(g.n, g.ez);
    g.loaded_radius = (g.n[0] * (w.x - below) + g.n[2] * (w.z - r.z)) / cosine;
    g.deflection = S(radius) - g.loaded_radius;
    g.approach = -dot3(V, g.n) / cosine;
  } else {
    const S d = w.z - r.z;
    g.loaded_radius = d * g.n[2] * g.n[2] / g.ez[2];
    g.deflection = S(radius) - d;
    g.approach = r.slope * V[0] - V[2];
    if (contact == TyreContact::source) {
      g.deflection *= g.n[2];
      g.approach *= g.n[2];
    }
  }
  g.forward = dot3(V, g.ex);
  g.lateral = dot3(V, g.eg);
}

}  // namespace costate
