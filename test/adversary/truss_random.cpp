// The mechanism of a seed.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "truss.h"

namespace costate::adversary {

Truss random_truss(std::uint64_t seed) {
  std::mt19937_64 engine(seed * 0x9E3779B97F4A7C15ull + 1);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
  const auto chance = [&](double p) { return uniform(0, 1) < p; };
  const auto pick = [&](std::size_t n) {
    return static_cast<int>(std::uniform_int_distribution<std::size_t>(0, n - 1)(engine));
  };
  const auto decades = [&](double a, double b) { return std::pow(10, uniform(a, b)); };
  Truss t;
  t.t_end = uniform(0.3, 2);
  const double length = chance(0.15) ? decades(-4, 3) : 1, mass = chance(0.15) ? decades(-4, 3) : 1;
  // With lengths, gravity shrinks, so that times stay those of the run.
  t.gravity[0] = chance(0.2) ? uniform(-5, 5) * length : 0;
  t.gravity[1] = chance(0.8) ? -9.81 * length : 0;

  const int grounds = 1 + pick(2), moving = 1 + pick(4);
  for (int i = 0; i < grounds; ++i) {
    Point p;
    p.name = fmt::format("G{}", i);
    p.ground = true;
    p.x[0] = i == 0 ? 0 : uniform(0.6, 1.6) * length;
    p.x[1] = i == 0 ? 0 : uniform(-0.3, 0.3) * length;
    t.points.push_back(p);
  }
  const auto distance = [&](int a, int b) {
    const Point &p = t.points[static_cast<std::size_t>(a)], &q = t.points[static_cast<std::size_t>(b)];
    return std::hypot(q.x[0] - p.x[0], q.x[1] - p.x[1]);
  };
  const auto add_bar = [&](int a, int b) {
    t.bars.push_back(
        {fmt::format("B{}", t.bars.size()), a, b, chance(0.2) ? 0 : mass * decades(-0.7, 0.7), distance(a, b)});
  };
  for (int i = 0; i < moving; ++i) {
    const int self = static_cast<int>(t.points.size()), parent = pick(t.points.size());
    Point p;
    p.name = fmt::format("P{}", i);
    const double angle = uniform(0, 6.283185307), l = uniform(0.4, 1.2) * length;
    for (int k = 0; k < 2; ++k)
      p.x[k] = t.points[static_cast<std::size_t>(parent)].x[k] + l * (k == 0 ? std::cos(angle) : std::sin(angle));
    t.points.push_back(p);
    if (chance(0.06)) {  // no bar at all: a free point
      t.points.back().mass = mass * decades(-0.7, 0.7);
      for (int k = 0; k < 2; ++k) {
        t.points.back().given[k] = true;
        t.points.back().v[k] = chance(0.5) ? uniform(-2, 2) * length : 0;
      }
      continue;
    }
    add_bar(parent, self);
    Point& point = t.points.back();
    int second = -1;
    if (self > 1 && chance(0.35)) {
      second = pick(static_cast<std::size_t>(self));
      // A triangle that is nearly flat has no well-determined corner.
      const Point &a = t.points[static_cast<std::size_t>(parent)], &b = t.points[static_cast<std::size_t>(second)];
      const double area =
          std::abs((a.x[0] - point.x[0]) * (b.x[1] - point.x[1]) - (a.x[1] - point.x[1]) * (b.x[0] - point.x[0]));
      if (second == parent || area < 0.2 * distance(parent, self) * distance(second, self)) second = -1;
    }
    if (second >= 0) {
      add_bar(second, self);
    } else {
      // The coordinate that moves most as the point turns about its parent.
      const double dx = std::abs(point.x[0] - t.points[static_cast<std::size_t>(parent)].x[0]),
                   dy = std::abs(point.x[1] - t.points[static_cast<std::size_t>(parent)].x[1]);
      const int axis = dy > dx ? 0 : 1;
      if (chance(0.12)) {
        Driver d{fmt::format("D{}", t.drivers.size()), self, axis, {}};
        d.law.kind = chance(0.5) ? TimeLaw::Kind::sine : chance(0.5) ? TimeLaw::Kind::pulse : TimeLaw::Kind::kink;
        d.law.a = point.x[axis];
        d.law.t1 = uniform(0.1, 0.8) * t.t_end;
        d.law.w = uniform(0.05, 0.3);
        d.law.t2 = d.law.t1 + d.law.w + uniform(0, 0.5);
        d.law.b = uniform(-0.15, 0.15) * l;
        d.law.c = d.law.kind == TimeLaw::Kind::kink ? uniform(-0.15, 0.15) * l : uniform(1, 8);
        t.drivers.push_back(d);
      } else {
        point.given[axis] = true;
        point.v[axis] = chance(0.3) ? uniform(-2, 2) * length : 0;
      }
    }
    if (chance(0.3) || t.bars.back().mass == 0) point.mass = mass * decades(-0.7, 0.7);
  }
  if (chance(0.12)) {
    const Bar& b = t.bars.empty() ? Bar{} : t.bars[static_cast<std::size_t>(pick(t.bars.size()))];
    if (!t.bars.empty()) {
      Bar twin = b;
      twin.name = fmt::format("B{}", t.bars.size());
      twin.mass = 0;
      t.bars.push_back(twin);
      t.redundant = true;
    }
  }
  // A point that nothing gives inertia would have none.
  for (std::size_t i = 0; i < t.points.size(); ++i) {
    if (t.points[i].ground || t.points[i].mass > 0) continue;
    bool heavy = false;
    for (const Bar& b : t.bars)
      heavy = heavy || ((b.a == static_cast<int>(i) || b.b == static_cast<int>(i)) && b.mass > 0);
    if (!heavy) t.points[i].mass = mass * decades(-0.7, 0.7);
  }
  const int first_moving = grounds;
  const auto moving_point = [&] { return first_moving + pick(static_cast<std::size_t>(moving)); };
  for (int k = pick(3); k > 0; --k) {
    Spring s;
    s.name = fmt::format("S{}", t.springs.size());
    s.b = moving_point();
    s.a = pick(t.points.size());
    if (s.a == s.b || distance(s.a, s.b) < 0.15 * length) continue;
    s.stiffness = mass * decades(0, chance(0.1) ? 5 : 2.5);
    s.length = distance(s.a, s.b) * uniform(0.5, 1.3);
    s.damping = chance(0.6) ? mass * decades(-1, 1) : 0;
    s.kinked = s.damping > 0 && chance(0.3);
    s.damping_out = s.kinked ? s.damping * uniform(0.2, 3) : s.damping;
    t.springs.push_back(s);
  }
  for (int k = pick(3); k > 0; --k) {
    Force f{fmt::format("F{}", t.forces.size()), moving_point(), pick(2), {}};
    const int kind = pick(3);
    f.law.kind = kind == 0 ? TimeLaw::Kind::constant : kind == 1 ? TimeLaw::Kind::sine : TimeLaw::Kind::pulse;
    f.law.a = kind == 2 ? 0 : uniform(-5, 5) * mass * length;
    f.law.b = uniform(-20, 20) * mass * length;
    f.law.c = uniform(1, 30);
    f.law.w = decades(-2.5, -1);
    f.law.t1 = uniform(0.05, 0.9) * t.t_end;
    f.law.t2 = f.law.t1 + f.law.w + uniform(0, 0.1);
    t.forces.push_back(f);
  }
  if (chance(0.1)) {  // nothing moves until something late does
    t.gravity[0] = t.gravity[1] = 0;
    t.springs.clear();
    t.drivers.erase(std::remove_if(t.drivers.begin(), t.drivers.end(),
                                   [](const Driver& d) { return d.law.kind != TimeLaw::Kind::pulse; }),
                    t.drivers.end());
    for (Point& p : t.points) p.v[0] = p.v[1] = 0;
    Force f{"late", moving_point(), pick(2), {}};
    f.law.kind = TimeLaw::Kind::pulse;
    f.law.b = uniform(5, 20) * mass * length;
    f.law.w = decades(-2.5, -1.5);
    f.law.t1 = uniform(0.5, 0.9) * t.t_end;
    f.law.t2 = f.law.t1 + f.law.w;
    t.forces = {f};
    // A point whose driver went is given instead.
    for (std::size_t i = 0; i < t.points.size(); ++i) {
      Point& p = t.points[i];
      if (p.ground || p.given[0] || p.given[1]) continue;
      int bars = 0, parent = 0;
      for (const Bar& b : t.bars)
        if (b.b == static_cast<int>(i)) {
          ++bars;
          parent = b.a;
        }
      const bool driven = std::any_of(t.drivers.begin(), t.drivers.end(),
                                      [&](const Driver& d) { return d.point == static_cast<int>(i); });
      std::set<int> parents;
      for (const Bar& b : t.bars)
        if (b.b == static_cast<int>(i)) parents.insert(b.a);
      if (driven || parents.size() != 1 || bars == 0) continue;
      const Point& a = t.points[static_cast<std::size_t>(parent)];
      p.given[std::abs(p.x[1] - a.x[1]) > std::abs(p.x[0] - a.x[0]) ? 0 : 1] = true;
    }
  }
  for (int k = 1 + pick(2); k > 0; --k) {
    Cost c;
    c.point = moving_point();
    c.axis = pick(2);
    c.rate = chance(0.3);
    c.terminal = chance(0.3);
    c.weight = uniform(0.5, 2);
    c.target = c.rate ? 0 : t.points[static_cast<std::size_t>(c.point)].x[c.axis] + uniform(-0.3, 0.3) * length;
    t.costs.push_back(c);
  }
  std::vector<Parameter> all;
  using K = Parameter::Kind;
  for (int i = 0; i < static_cast<int>(t.springs.size()); ++i) {
    all.push_back({K::stiffness, i, 0});
    all.push_back({K::natural_length, i, 0});
    if (!t.springs[static_cast<std::size_t>(i)].kinked) all.push_back({K::damping, i, 0});
  }
  for (int i = 0; i < static_cast<int>(t.bars.size()); ++i) {
    if (!t.redundant) all.push_back({K::bar_length, i, 0});
    if (t.bars[static_cast<std::size_t>(i)].mass > 0) all.push_back({K::bar_mass, i, 0});
  }
  for (int i = 0; i < static_cast<int>(t.forces.size()); ++i)
    if (t.forces[static_cast<std::size_t>(i)].law.kind == TimeLaw::Kind::constant) all.push_back({K::force, i, 0});
  for (int i = 0; i < static_cast<int>(t.points.size()); ++i) {
    const Point& p = t.points[static_cast<std::size_t>(i)];
    if (p.mass > 0) all.push_back({K::point_mass, i, 0});
    for (int k = 0; k < 2; ++k) {
      if (p.ground || p.given[k]) all.push_back({K::position, i, k});
      if (p.given[k]) all.push_back({K::velocity, i, k});
    }
  }
  if (t.gravity[1] != 0) all.push_back({K::gravity, 0, 1});
  std::shuffle(all.begin(), all.end(), engine);
  all.resize(std::min<std::size_t>(all.size(), 1 + static_cast<std::size_t>(pick(3))));
  t.parameters = all;
  return t;
}

Truss switched_truss(std::uint64_t seed) {
  Truss t = random_truss(seed);
  std::mt19937_64 engine(seed * 0xBF58476D1CE4E5B9ull + 11);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
  const auto chance = [&](double p) { return uniform(0, 1) < p; };
  const auto pick = [&](std::size_t n) {
    return static_cast<int>(std::uniform_int_distribution<std::size_t>(0, n - 1)(engine));
  };
  using K = Parameter::Kind;
  std::vector<int> moving;
  double mass = 0, length = 0;
  for (std::size_t i = 0; i < t.points.size(); ++i) {
    if (!t.points[i].ground) moving.push_back(static_cast<int>(i));
    mass = std::max(mass, t.points[i].mass);
  }
  for (const Bar& b : t.bars) {
    mass = std::max(mass, b.mass);
    length = std::max(length, b.length);
  }
  if (length == 0) length = 1;
  std::vector<Parameter> times;
  for (int k = 1 + pick(2); k > 0; --k) {
    Force f{fmt::format("W{}", t.forces.size()), moving[static_cast<std::size_t>(pick(moving.size()))], pick(2), {}};
    f.law.kind = TimeLaw::Kind::steps;
    f.law.a = chance(0.5) ? 0 : uniform(-10, 10) * mass * length;
    f.law.b = uniform(-20, 20) * mass * length;
    f.law.c = uniform(-10, 10) * mass * length;
    f.law.t1 = uniform(0.05, 0.6) * t.t_end;
    f.law.t2 = f.law.t1 + uniform(0.02, 0.3) * t.t_end;
    // Together with another's: either right or refused.
    if (chance(0.15) && t.forces.size() > 0 && t.forces.back().law.kind == TimeLaw::Kind::steps)
      f.law.t2 = std::max(t.forces.back().law.t2, f.law.t1 + 0.02 * t.t_end);
    times.push_back({K::force_time, static_cast<int>(t.forces.size()), 0});
    times.push_back({K::force_time, static_cast<int>(t.forces.size()), 1});
    t.forces.push_back(f);
  }
  for (std::size_t i = 0; i < t.costs.size(); ++i)
    if (!t.costs[i].terminal && chance(0.4)) {
      t.costs[i].from = uniform(0.05, 0.9) * t.t_end;
      times.push_back({K::cost_time, static_cast<int>(i), 0});
    }
  std::shuffle(times.begin(), times.end(), engine);
  times.resize(1 + static_cast<std::size_t>(pick(std::min<std::size_t>(times.size(), 3))));
  t.parameters.resize(std::min<std::size_t>(t.parameters.size(), 1));
  t.parameters.insert(t.parameters.end(), times.begin(), times.end());
  return t;
}

}  // namespace costate::adversary
