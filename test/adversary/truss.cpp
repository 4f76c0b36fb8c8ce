#include "truss.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace costate::adversary {

namespace {

std::string num(double x) { return fmt::format("{:.17g}", x); }
const char* kAxis[] = {"x", "y"};

/// The quintic that leads from 0 to 1 with two derivatives zero at both ends, and its derivatives in u.
double quintic(double u, int derivative) {
  if (u <= 0) return 0;
  if (u >= 1) return derivative == 0 ? 1 : 0;
  switch (derivative) {
    case 0:
      return u * u * u * (10 + u * (-15 + 6 * u));
    case 1:
      return 30 * u * u * (1 - u) * (1 - u);
    default:
      return 60 * u * (1 - u) * (1 - 2 * u);
  }
}

}  // namespace

double TimeLaw::value(double t) const {
  switch (kind) {
    case Kind::constant:
      return a;
    case Kind::sine:
      return a + b * std::sin(c * t);
    case Kind::pulse:
      return a + b * (quintic((t - t1) / w, 0) - quintic((t - t2) / w, 0));
    case Kind::kink:
      return t <= t1 ? a + b * t : a + b * t1 + c * (t - t1);
  }
  return 0;
}

double TimeLaw::rate(double t) const {
  switch (kind) {
    case Kind::constant:
      return 0;
    case Kind::sine:
      return b * c * std::cos(c * t);
    case Kind::pulse:
      return b / w * (quintic((t - t1) / w, 1) - quintic((t - t2) / w, 1));
    case Kind::kink:
      return t < t1 ? b : c;
  }
  return 0;
}

double TimeLaw::second(double t) const {
  switch (kind) {
    case Kind::sine:
      return -b * c * c * std::sin(c * t);
    case Kind::pulse:
      return b / (w * w) * (quintic((t - t1) / w, 2) - quintic((t - t2) / w, 2));
    default:
      return 0;
  }
}

std::vector<double> TimeLaw::breaks() const {
  if (kind == Kind::pulse) return {t1, t1 + w, t2, t2 + w};
  if (kind == Kind::kink) return {t1};
  return {};
}

void TimeLaw::scale(double factor) {
  a *= factor;
  b *= factor;
  if (kind == Kind::kink) c *= factor;
}

std::string TimeLaw::text() const {
  switch (kind) {
    case Kind::constant:
      return num(a);
    case Kind::sine:
      return fmt::format(
          "{{ kind = \"sine\", mean = {}, amplitude = {}, angular_frequency_rad_per_s = {}, phase_rad = 0 }}", num(a),
          num(b), num(c));
    case Kind::pulse:
      return fmt::format(
          "{{ kind = \"sum\", terms = [{{ kind = \"smooth_step\", from = {}, to = {}, before = {}, after = "
          "{} }}, "
          "{{ kind = \"smooth_step\", from = {}, to = {}, before = 0, after = {} }}] }}",
          num(t1), num(t1 + w), num(a), num(a + b), num(t2), num(t2 + w), num(-b));
    case Kind::kink:
      return fmt::format("{{ kind = \"piecewise\", breaks = [{}], coefficients = [[{}, {}], [{}, {}]] }}", num(t1),
                         num(a), num(b), num(a + b * t1 - c * t1), num(c));
  }
  return {};
}

double& Truss::number(const Parameter& p) {
  const auto e = static_cast<std::size_t>(p.element);
  switch (p.kind) {
    case Parameter::Kind::stiffness:
      return springs[e].stiffness;
    case Parameter::Kind::natural_length:
      return springs[e].length;
    case Parameter::Kind::damping:
      return springs[e].damping;
    case Parameter::Kind::bar_length:
      return bars[e].length;
    case Parameter::Kind::bar_mass:
      return bars[e].mass;
    case Parameter::Kind::point_mass:
      return points[e].mass;
    case Parameter::Kind::force:
      return forces[e].law.a;
    case Parameter::Kind::position:
      return points[e].x[p.axis];
    case Parameter::Kind::velocity:
      return points[e].v[p.axis];
    case Parameter::Kind::gravity:
      return gravity[p.axis];
  }
  return gravity[0];
}

std::string Truss::path(const Parameter& p) const {
  const auto e = static_cast<std::size_t>(p.element);
  switch (p.kind) {
    case Parameter::Kind::stiffness:
      return "spring." + springs[e].name + ".stiffness_N_per_m";
    case Parameter::Kind::natural_length:
      return "spring." + springs[e].name + ".natural_length_m";
    case Parameter::Kind::damping:
      return "spring." + springs[e].name + ".damping_N_s_per_m";
    case Parameter::Kind::bar_length:
      return "bar." + bars[e].name + ".length_m";
    case Parameter::Kind::bar_mass:
      return "bar." + bars[e].name + ".mass_kg";
    case Parameter::Kind::point_mass:
      return "mass.m" + points[e].name + ".mass_kg";
    case Parameter::Kind::force:
      return "force." + forces[e].name + "." + kAxis[forces[e].axis] + "_N";
    case Parameter::Kind::position:
      return "point." + points[e].name + "." + kAxis[p.axis] + "_m";
    case Parameter::Kind::velocity:
      return "point." + points[e].name + ".v" + kAxis[p.axis] + "_m_per_s";
    case Parameter::Kind::gravity:
      return std::string("gravity.") + kAxis[p.axis] + "_m_per_s2";
  }
  return {};
}

double Truss::scale(const Parameter& p) const {
  double size = 0;
  for (const Bar& b : bars) size = std::max(size, b.length);
  switch (p.kind) {
    case Parameter::Kind::natural_length:
    case Parameter::Kind::bar_length:
    case Parameter::Kind::position:
      return size;
    case Parameter::Kind::velocity:
      return size / t_end;
    case Parameter::Kind::gravity:
      return size / (t_end * t_end);
    case Parameter::Kind::damping: {
      // A damper that is zero has a size all the same: a tenth of what would be critical.
      double mass = 0;
      for (const Point& point : points) mass = std::max(mass, point.mass);
      for (const Bar& b : bars) mass = std::max(mass, b.mass);
      const double critical = 2 * std::sqrt(springs[static_cast<std::size_t>(p.element)].stiffness * mass);
      return std::max(std::abs(number(p)), 0.1 * critical);
    }
    default:
      break;
  }
  return std::max(std::abs(number(p)), 1e-300);
}

std::string Truss::scene() const {
  std::string s = fmt::format("[gravity]\nx_m_per_s2 = {}\ny_m_per_s2 = {}\n", num(gravity[0]), num(gravity[1]));
  std::string given;
  for (const Point& p : points) {
    s += fmt::format("[point.{}]\n{}x_m = {}\ny_m = {}\n", p.name, p.ground ? "ground = true\n" : "", num(p.x[0]),
                     num(p.x[1]));
    for (int i = 0; i < 2; ++i) {
      if (p.given[i]) s += fmt::format("v{}_m_per_s = {}\n", kAxis[i], num(p.v[i]));
      if (p.given[i]) given += fmt::format("{}\"{}.{}\"", given.empty() ? "" : ", ", p.name, kAxis[i]);
    }
    if (p.mass > 0) s += fmt::format("[mass.m{}]\npoint = \"{}\"\nmass_kg = {}\n", p.name, p.name, num(p.mass));
  }
  const auto name = [&](int i) { return points[static_cast<std::size_t>(i)].name; };
  for (const Bar& b : bars)
    s += fmt::format("[bar.{}]\nfrom = \"{}\"\nto = \"{}\"\nmass_kg = {}\nlength_m = {}\n", b.name, name(b.a),
                     name(b.b), num(b.mass), num(b.length));
  for (const Spring& f : springs) {
    s += fmt::format("[spring.{}]\nfrom = \"{}\"\nto = \"{}\"\nstiffness_N_per_m = {}\nnatural_length_m = {}\n", f.name,
                     name(f.a), name(f.b), num(f.stiffness), num(f.length));
    if (f.kinked)
      s += fmt::format("damper_law = {{ kind = \"piecewise\", breaks = [0], coefficients = [[0, {}], [0, {}]] }}\n",
                       num(f.damping), num(f.damping_out));
    else
      s += fmt::format("damping_N_s_per_m = {}\n", num(f.damping));
  }
  for (const Force& f : forces)
    s += fmt::format("[force.{}]\npoint = \"{}\"\n{}_N = {}\n", f.name, name(f.point), kAxis[f.axis], f.law.text());
  for (const Driver& d : drivers)
    s += fmt::format("[driver.{}]\ncoordinate = \"{}.{}\"\nlaw = {}\n", d.name, name(d.point), kAxis[d.axis],
                     d.law.text());
  s += fmt::format("[start]\ngiven = [{}]\n", given);
  for (const Cost& c : costs)
    s += fmt::format("[[cost.{}]]\nkind = \"{}\"\noutput = \"{}.{}{}\"\nweight = {}\ntarget = {}\n",
                     c.terminal ? "terminal" : "running", c.terminal ? "value" : "square", name(c.point), kAxis[c.axis],
                     c.rate ? "_dot" : "", num(c.weight), num(c.target));
  std::string list;
  for (const Parameter& p : parameters) list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", path(p));
  s += fmt::format("[run]\nt_end_s = {}\nrtol = 1e-8\nparameters = [{}]\n", num(t_end), list);
  return s;
}

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
        p.element = flipped(forces.size(), p.element);
        break;
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
    list.push_back(*this);
    list.back().costs.erase(list.back().costs.begin() + static_cast<long>(i));
  }
  for (std::size_t i = 0; i < springs.size(); ++i)
    if (!used({K::stiffness, K::natural_length, K::damping}, i)) {
      list.push_back(*this);
      list.back().springs.erase(list.back().springs.begin() + static_cast<long>(i));
      shift(list.back(), {K::stiffness, K::natural_length, K::damping}, i);
    }
  for (std::size_t i = 0; i < forces.size(); ++i)
    if (!used({K::force}, i)) {
      list.push_back(*this);
      list.back().forces.erase(list.back().forces.begin() + static_cast<long>(i));
      shift(list.back(), {K::force}, i);
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

}  // namespace costate::adversary
