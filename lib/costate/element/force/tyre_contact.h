// Where a wheel meets the ground. e_y is the wheel's axis, n the ground's normal, and, all normalised,
//   e_x = e_y x n (where the wheel points),  e_g = n x e_x (the axis projected on the ground),  e_z = e_x x
//   e_y.
// The contact point is the centre - r_w e_z: that of a disc with the ground's tangent plane;
// camber = atan(n.e_y / n.e_z). With V the centre's velocity and omega the wheel's angular velocity, the disc's point
// that is there moves, but for the spin about e_y (which turns it along e_x alone), with
//   V_c = V - r_w (omega - (omega.e_y) e_y) x e_z = V + r_w (e_y'.e_z) e_y:
// slips and the damper of a disc belong to V_c, so that neither does work on a wheel that leans or rolls over; those of
// the other contacts to V.
#pragma once

#include <cmath>

#include "costate/element/force/road.h"
#include "costate/element/point/rotation.h"

namespace costate {

/// How the deflection and the normal force follow from the geometry. s is the ground's slope, z_p its height
/// below the centre, d = z_centre - z_p, H = sqrt(1 + s^2).
enum class TyreContact {
  /// The disc's lowest point against the tangent plane below it: deflection R - r_w, approach -V_c.n / (n.e_z), which
  /// on level ground is the deflection's rate; on a curved profile that of the tangent plane at rest.
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
  S forward, lateral;      // V_c.e_x, V_c.e_g, m/s
  S camber;                // rad
};

/// The wheel as the contact sees it. axis needs not be normalised.
template <class S>
struct WheelState {
  S x, z;  // of the centre
  S axis[3], velocity[3];
  S axis_rate[3];  // of `axis` by time, 1/s
};

template <class S>
S length3(const S* a) {
  using std::sqrt;
  return sqrt(dot3(a, a));
}

/// Returns what it has multiplied by.
template <class S>
S normalise3(S* a) {
  const S factor = S(1.0) / length3(a);
  for (int i = 0; i < 3; ++i) a[i] *= factor;
  return factor;
}

/// The directions for a level ground, n = (0, 0, 1). Returns 1 / |axis|, as the next one does.
template <class S>
S level_directions(const S* axis, TyreGeometry<S>& g) {
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
  return factor;
}

template <class S>
S sloped_directions(const S* axis, const S& slope, TyreGeometry<S>& g) {
  using std::atan;
  using std::sqrt;
  g.n[2] = S(1.0) / sqrt(S(1.0) + slope * slope);
  g.n[0] = -slope * g.n[2];
  g.n[1] = S(0.0);
  for (int i = 0; i < 3; ++i) g.ey[i] = axis[i];
  const S factor = normalise3(g.ey);
  cross3(g.ey, g.n, g.ex);
  normalise3(g.ex);
  cross3(g.n, g.ex, g.eg);  // normalised: n and e_x are, and perpendicular
  cross3(g.ex, g.ey, g.ez);
  g.camber = atan(dot3(g.n, g.ey) / dot3(g.n, g.ez));
  return factor;
}

/// V_c of a disc. per_length: 1 / |axis|.
template <class S>
void calc_contact_velocity(const WheelState<S>& w, const TyreGeometry<S>& g, const S& per_length, S* V) {
  const S leaning = g.loaded_radius * per_length * dot3(w.axis_rate, g.ez);
  for (int i = 0; i < 3; ++i) V[i] = w.velocity[i] + leaning * g.ey[i];
}

/// factor, shift: the tyre's share of the road (Road::at); p: the road's numbers.
template <class S, class P>
void calc_tyre_geometry(const Road& road, TyreContact contact, const S& t, const WheelState<S>& w, const P& radius,
                        const P& factor, const P& shift, const P* p, TyreGeometry<S>& g) {
  using std::sqrt;
  const S* V = w.velocity;
  S of_disc[3];
  if (road.level()) {
    const RoadPoint<S> r = road.at(t, w.x, factor, shift, p);
    const S per_length = level_directions(w.axis, g);
    const S d = w.z - r.z;
    g.loaded_radius = d / g.ez[2];
    if (contact == TyreContact::disc) {
      calc_contact_velocity(w, g, per_length, of_disc);
      V = of_disc;
      g.deflection = S(radius) - g.loaded_radius;
      g.approach = (r.rate - V[2]) / g.ez[2];
    } else {
      g.deflection = S(radius) - d;
      g.approach = r.rate - V[2];
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
  const S per_length = sloped_directions(w.axis, r.slope, g);
  if (contact == TyreContact::disc) {
    const S cosine = dot3(g.n, g.ez);
    g.loaded_radius = (g.n[0] * (w.x - below) + g.n[2] * (w.z - r.z)) / cosine;
    g.deflection = S(radius) - g.loaded_radius;
    calc_contact_velocity(w, g, per_length, of_disc);
    V = of_disc;
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
