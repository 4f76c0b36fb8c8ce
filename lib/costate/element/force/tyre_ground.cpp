#include "costate/element/force/tyre_ground.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "costate/base/error.h"
#include "costate/element/point/rotation.h"

namespace costate {

void TyreGround::add_course(const double* p, Course& course) const {
  if (setup_.road->kind() == Road::Kind::post) add_track(0, p, course);
}

void TyreGround::add_track(int, const double* p, Course& course) const {
  setup_.road->add_course(p[TyreNumbers::shift], p + TyreNumbers::road, course);
}

void TyreGround::add_force_jumps(const double* p, std::vector<double>& times) const {
  setup_.road->add_post_jumps(p[TyreNumbers::shift], p + TyreNumbers::road, times);
}

void TyreGround::add_force_bends(const double* p, std::vector<double>& times) const {
  setup_.road->add_post_bends(p[TyreNumbers::shift], p + TyreNumbers::road, times);
}

void TyreGround::add_time_slopes(double t, const double* p, double* by) const {
  setup_.road->add_post_slopes(t, p[TyreNumbers::shift], p + TyreNumbers::road, by[TyreNumbers::shift],
                               by + TyreNumbers::road);
}

CourseElement::Place TyreGround::track_place(int, const LocalState& s) const {
  double r[3], u[3];
  rotated(s.q + 3, s.p + TyreNumbers::center, r);
  rotated_rate(s.q + 3, s.v + 3, s.p + TyreNumbers::center, u);
  return {s.q[0] + r[0], s.v[0] + u[0]};
}

TyreGeometry<double> TyreGround::geometry(const LocalState& s) const {
  WheelState<double> w;
  calc_wheel_state(s.q, s.v, s.p, w);
  TyreGeometry<double> g;
  calc_tyre_geometry(*setup_.road, setup_.contact, s.t, w, s.p[TyreNumbers::radius], s.p[TyreNumbers::share],
                     s.p[TyreNumbers::shift], s.p + TyreNumbers::road, g);
  return g;
}

double TyreGround::unclipped_force(const LocalState& s, const TyreGeometry<double>& g) const {
  const double ramp = s.p[TyreNumbers::ramp], part = g.deflection < ramp ? g.deflection / ramp : 1;
  return s.p[TyreNumbers::stiffness] * g.deflection + s.p[TyreNumbers::damping] * g.approach * part;
}

void TyreGround::add_bends(const LocalState& s, std::vector<double>& beyond) const {
  const TyreGeometry<double> g = geometry(s);
  const double ramp = s.p[TyreNumbers::ramp], force = unclipped_force(s, g);
  beyond.push_back(g.deflection);
  beyond.push_back(s.p[TyreNumbers::damping] > 0 ? g.deflection - ramp : -1);
  beyond.push_back(g.deflection > 0 ? force : s.p[TyreNumbers::stiffness] * g.deflection);
}

void TyreGround::add_jump_places(const LocalState& s, bool fixed_steps, std::vector<JumpPlace>& places) const {
  const TyreGeometry<double> g = geometry(s);
  const double radius = s.p[TyreNumbers::radius], ramp = s.p[TyreNumbers::ramp];
  places.push_back({.beyond = radius - g.deflection,
                    .direction = -1,
                    .what = "is pressed in by more than its radius: the wheel's centre is below the ground",
                    .advice = "Its force is that of its law all the same. Look at the wheel's height, and the road's",
                    .of_motion = true});
  const bool at_once = ramp < kAtOnce * radius;
  if (setup_.bilateral || !(at_once || fixed_steps)) return;
  places.push_back(
      {g.deflection, 1, s.p[TyreNumbers::damping] * std::max(g.approach, 0.0),
       at_once ? "touches, and its damping sets in at once" : "touches, and its damping sets in within one fixed step",
       at_once ? "Let damping grow over a deflection (damping_ramp_m: 1e-3 m)"
               : "Take shorter steps (--step, run.step_s), or a longer damping_ramp_m",
       false, at_once ? 0 : ramp});
}

void TyreGround::add_complaints(const LocalState& s, std::vector<std::string>& said) const {
  constexpr double most_camber = 60, most_radii = 3;  // degrees, 1
  const TyreGeometry<double> g = geometry(s);
  if (!setup_.bilateral && !(g.deflection > 0)) return;
  const double camber = g.camber * 180 / std::numbers::pi, radius = s.p[TyreNumbers::radius];
  if (std::abs(camber) > most_camber) said.push_back(fmt::format("lies almost flat (camber {:.4g} degrees)", camber));
  if (std::abs(g.loaded_radius) > most_radii * radius)
    said.push_back(fmt::format("has its contact point {:.4g} m from the wheel's centre (radius {:.4g} m)",
                               std::abs(g.loaded_radius), radius));
}

void TyreGround::throw_singular(const std::string& tyre, double t, const TyreGeometry<double>& g) const {
  if (lies_flat(g))
    throw StepError(
        fmt::format("The wheel of tyre '{}' lies flat at t = {:.6g} s: its axis is along the ground's normal, where "
                    "the tyre's contact is not defined.",
                    tyre, t));
  throw StepError(fmt::format(
      "The contact point of tyre '{}' runs off at t = {:.6g} s: on a slope of {:.3g} and with a camber of {:.3g} "
      "degrees "
      "the wheel's disc is no longer above it as contact = \"{}\" has it. contact = \"disc\" goes on to 90 degrees.",
      tyre, t, -g.n[0] / g.n[2], g.camber * 180 / std::numbers::pi,
      setup_.contact == TyreContact::source ? "source" : "vertical"));
}

GapMotion TyreGround::gap_motion(int, const LocalState& s) const {
  // Along the motion: derivatives by time.
  using D = Dual<1>;
  const auto moving = [](double x, double rate) {
    D d(x);
    d.d[0] = rate;
    return d;
  };
  D e[4], center[3], axis[3], r[3];
  for (int i = 0; i < 4; ++i) e[i] = moving(s.q[3 + i], s.v[3 + i]);
  for (int i = 0; i < 3; ++i) {
    center[i] = D(s.p[TyreNumbers::center + i]);
    axis[i] = D(s.p[TyreNumbers::axis + i]);
  }
  rotated(e, center, r);
  WheelState<D> w;
  w.x = moving(s.q[0], s.v[0]) + r[0];
  w.z = moving(s.q[2], s.v[2]) + r[2];
  rotated(e, axis, w.axis);
  for (D& v : w.velocity) v = D(0.0);
  for (D& v : w.axis_rate) v = D(0.0);
  TyreGeometry<D> g;
  const double R = s.p[TyreNumbers::radius];
  calc_tyre_geometry(*setup_.road, setup_.contact, moving(s.t, 1), w, R, s.p[TyreNumbers::share],
                     s.p[TyreNumbers::shift], s.p + TyreNumbers::road, g);
  GapMotion m;
  m.gap = -g.deflection.v;
  m.rate = -g.deflection.d[0];
  // Of a centre at its body's origin only the tilt of the axis counts.
  const double lever = length3(s.p + TyreNumbers::center);
  const double rates[3] = {w.axis[0].d[0], w.axis[1].d[0], w.axis[2].d[0]};
  m.turn = lever > 0 ? 2 * std::sqrt(s.v[3] * s.v[3] + s.v[4] * s.v[4] + s.v[5] * s.v[5] + s.v[6] * s.v[6])
                     : length3(rates) / length3(s.p + TyreNumbers::axis);
  const double tilting = std::abs(g.loaded_radius.v * std::tan(g.camber.v)) * m.turn;
  if (setup_.road->level()) {
    // Without a velocity the ground alone approaches.
    const double height = w.z.v - g.loaded_radius.v * g.ez[2].v;
    m.travel = std::abs(s.v[2]) + std::abs(g.approach.v * g.ez[2].v);
    m.clear = s.q[2] - lever - height - R;
    m.speed = m.travel + lever * m.turn + tilting;
  } else {
    const double slope = std::abs(g.n[0].v / g.n[2].v);
    m.speed = std::abs(s.v[2]) + slope * std::abs(s.v[0]) + (1 + slope) * lever * m.turn + tilting;
    m.clear = m.gap;
    m.travel = m.speed;
  }
  return m;
}

}  // namespace costate
