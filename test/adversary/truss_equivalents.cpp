// A mechanism in other words, whose motion is the same, and smaller ones.
#include <algorithm>

#include "truss.h"

namespace costate::adversary {

Truss Truss::mirrored() const {
  Truss r = *this;
  r.gravity[0] = -r.gravity[0];
  for (Point& p : r.points) {
    p.x[0] = -p.x[0];
    p.v[0] = -p.v[0];
  }
  for (Force& f : r.forces)
    if (f.axis == 0) f.law.scale(-1);
  for (Driver& d : r.drivers)
    if (d.axis == 0) d.law.scale(-1);
  for (Cost& c : r.costs)
    if (c.axis == 0) {
      c.target = -c.target;
      if (c.terminal) c.weight = -c.weight;
    }
  return r;
}

Truss Truss::turned() const {
  Truss r = *this;
  const auto turn = [](double* v) {
    const double x = v[0];
    v[0] = -v[1];
    v[1] = x;
  };
  turn(r.gravity);
  for (Point& p : r.points) {
    turn(p.x);
    turn(p.v);
    std::swap(p.given[0], p.given[1]);
  }
  const auto turn_law = [](int& axis, TimeLaw& law) {
    if (axis == 1) law.scale(-1);
    axis = 1 - axis;
  };
  for (Force& f : r.forces) turn_law(f.axis, f.law);
  for (Driver& d : r.drivers) turn_law(d.axis, d.law);
  for (Cost& c : r.costs) {
    if (c.axis == 1) {
      c.target = -c.target;
      if (c.terminal) c.weight = -c.weight;
    }
    c.axis = 1 - c.axis;
  }
  for (Parameter& p : r.parameters)
    if (p.kind == Parameter::Kind::position || p.kind == Parameter::Kind::velocity ||
        p.kind == Parameter::Kind::gravity)
      p.axis = 1 - p.axis;
  return r;
}

Truss Truss::renamed() const {
  Truss r = *this;
  const auto last = [](auto& list) {
    for (auto& e : list) e.name = "z" + e.name + "_";
    std::reverse(list.begin(), list.end());
  };
  const auto flipped = [](std::size_t n, int i) { return static_cast<int>(n) - 1 - i; };
  for (Bar& b : r.bars) {
    const int a = b.a;
    b.a = flipped(points.size(), b.b);
    b.b = flipped(points.size(), a);
  }
  for (Spring& s : r.springs) {
    const int a = s.a;
    s.a = flipped(points.size(), s.b);
    s.b = flipped(points.size(), a);
  }
  for (Force& f : r.forces) f.point = flipped(points.size(), f.point);
  for (Driver& d : r.drivers) d.point = flipped(points.size(), d.point);
  for (Cost& c : r.costs) c.point = flipped(points.size(), c.point);
  for (Parameter& p : r.parameters) switch (p.kind) {
      case Parameter::Kind::stiffness:
      case Parameter::Kind::natural_length:
      case Parameter::Kind::damping:
        p.element = flipped(springs.size(), p.element);
        break;
      case Parameter::Kind::bar_length:
      case Parameter::Kind::bar_mass:
        p.element = flipped(bars.size(), p.element);
        break;
      case Parameter::Kind::point_mass:
      case Parameter::Kind::position:
      case Parameter::Kind::velocity:
        p.element = flipped(points.size(), p.element);
        break;
      case Parameter::Kind::force:
      case Parameter::Kind::force_time:
        p.element = flipped(forces.size(), p.element);
        break;
      case Parameter::Kind::cost_time:
      case Parameter::Kind::gravity:
        break;
    }
  last(r.points);
  last(r.bars);
  last(r.springs);
  last(r.forces);
  last(r.drivers);
  return r;
}

std::vector<Truss> Truss::smaller() const {
  std::vector<Truss> list;
  const auto used = [&](std::initializer_list<Parameter::Kind> kinds, std::size_t element) {
    return std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& p) {
      return p.element == static_cast<int>(element) && std::find(kinds.begin(), kinds.end(), p.kind) != kinds.end();
    });
  };
  const auto shift = [](Truss& t, std::initializer_list<Parameter::Kind> kinds, std::size_t element) {
    for (Parameter& p : t.parameters)
      if (p.element > static_cast<int>(element) && std::find(kinds.begin(), kinds.end(), p.kind) != kinds.end())
        --p.element;
  };
  using K = Parameter::Kind;
  for (std::size_t i = 0; parameters.size() > 1 && i < parameters.size(); ++i) {
    list.push_back(*this);
    list.back().parameters.erase(list.back().parameters.begin() + static_cast<long>(i));
  }
  for (std::size_t i = 0; costs.size() > 1 && i < costs.size(); ++i) {
    if (used({K::cost_time}, i)) continue;
    list.push_back(*this);
    list.back().costs.erase(list.back().costs.begin() + static_cast<long>(i));
    shift(list.back(), {K::cost_time}, i);
  }
  for (std::size_t i = 0; i < springs.size(); ++i)
    if (!used({K::stiffness, K::natural_length, K::damping}, i)) {
      list.push_back(*this);
      list.back().springs.erase(list.back().springs.begin() + static_cast<long>(i));
      shift(list.back(), {K::stiffness, K::natural_length, K::damping}, i);
    }
  for (std::size_t i = 0; i < forces.size(); ++i)
    if (!used({K::force, K::force_time}, i)) {
      list.push_back(*this);
      list.back().forces.erase(list.back().forces.begin() + static_cast<long>(i));
      shift(list.back(), {K::force, K::force_time}, i);
    }
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].mass > 0 && !used({K::point_mass}, i)) {
      list.push_back(*this);
      list.back().points[i].mass = 0;
    }
  list.push_back(*this);
  list.back().t_end = t_end / 2;
  return list;
}

}  // namespace costate::adversary
