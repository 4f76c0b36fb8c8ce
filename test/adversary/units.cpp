#include "units.h"

#include <cmath>

namespace costate::adversary {

const std::vector<Units>& all_units() {
  // The last three are those of codes for crashes, for micromechanics and for things that take days.
  static const std::vector<Units> list = {{"mm", 1e3, 1, 1},           {"inch, pound", 1 / 0.0254, 1 / 0.45359237, 1},
                                          {"km", 1e-3, 1, 1},          {"g", 1, 1e3, 1},
                                          {"mm, t", 1e3, 1e-3, 1},     {"cm, g", 1e2, 1e3, 1},
                                          {"ms", 1, 1, 1e3},           {"mm, kg, ms", 1e3, 1, 1e3},
                                          {"um, kg, us", 1e6, 1, 1e6}, {"km, t, h", 1e-3, 1e-3, 1.0 / 3600}};
  return list;
}

namespace {

void change(TimeLaw& law, double value, double time) {
  law.scale(value);
  law.t1 *= time;
  law.t2 *= time;
  law.w *= time;
  if (law.kind == TimeLaw::Kind::sine) law.c /= time;
  if (law.kind == TimeLaw::Kind::kink) {  // both are slopes
    law.b /= time;
    law.c /= time;
  }
}

}  // namespace

Truss in_units(const Truss& truss, const Units& u) {
  Truss r = truss;
  const double speed = u.length / u.time, acceleration = speed / u.time, force = u.mass * acceleration;
  for (double& g : r.gravity) g *= acceleration;
  for (Point& p : r.points) {
    for (double& x : p.x) x *= u.length;
    for (double& v : p.v) v *= speed;
    p.mass *= u.mass;
  }
  for (Bar& b : r.bars) {
    b.mass *= u.mass;
    b.length *= u.length;
  }
  for (Spring& s : r.springs) {
    s.stiffness *= u.mass / (u.time * u.time);
    s.length *= u.length;
    s.damping *= u.mass / u.time;
    s.damping_out *= u.mass / u.time;
  }
  for (Force& f : r.forces) change(f.law, force, u.time);
  for (Driver& d : r.drivers) change(d.law, u.length, u.time);
  for (Cost& c : r.costs) {
    const double y = c.rate ? speed : u.length;
    c.target *= y;
    c.from *= u.time;
    c.weight /= c.terminal ? y : y * y * u.time;
  }
  r.t_end *= u.time;
  return r;
}

double growth(const Parameter& p, const Units& u) {
  switch (p.kind) {
    case Parameter::Kind::stiffness:
      return u.mass / (u.time * u.time);
    case Parameter::Kind::damping:
      return u.mass / u.time;
    case Parameter::Kind::natural_length:
    case Parameter::Kind::bar_length:
    case Parameter::Kind::position:
      return u.length;
    case Parameter::Kind::bar_mass:
    case Parameter::Kind::point_mass:
      return u.mass;
    case Parameter::Kind::force:
      return u.mass * u.length / (u.time * u.time);
    case Parameter::Kind::velocity:
      return u.length / u.time;
    case Parameter::Kind::gravity:
      return u.length / (u.time * u.time);
    case Parameter::Kind::force_time:
    case Parameter::Kind::cost_time:
      return u.time;
  }
  return 1;
}

Truth in_units(const Truth& truth, const Truss& truss, const Units& units) {
  Truth r = truth;
  for (std::size_t j = 0; j < r.gradient.size(); ++j) {
    const double by = growth(truss.parameters[j], units);
    r.gradient[j] /= by;
    r.uncertainty[j] /= by;
    r.scales[j] *= by;
  }
  return r;
}

}  // namespace costate::adversary
