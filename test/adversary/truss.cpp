#include "truss.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
    case Kind::steps:
      return t < t1 ? a : t < t2 ? b : c;
  }
  return 0;
}

double TimeLaw::rate(double t) const {
  switch (kind) {
    case Kind::constant:
    case Kind::steps:
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
  if (kind == Kind::steps) return {t1, t2};
  return {};
}

void TimeLaw::scale(double factor) {
  a *= factor;
  b *= factor;
  if (kind == Kind::kink || kind == Kind::steps) c *= factor;
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
    case Kind::steps:
      return fmt::format(
          "{{ kind = \"piecewise\", breaks = [{}, {}], coefficients = [[{}], [{}], [{}]], joins = \"none\" }}", num(t1),
          num(t2), num(a), num(b), num(c));
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
    case Parameter::Kind::force_time:
      return p.axis == 0 ? forces[e].law.t1 : forces[e].law.t2;
    case Parameter::Kind::cost_time:
      return costs[e].from;
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
    case Parameter::Kind::force_time:
      return fmt::format("force.{}.{}_N.breaks[{}]", forces[e].name, kAxis[forces[e].axis], p.axis);
    case Parameter::Kind::cost_time: {
      // Costs are counted by their kind.
      const auto end = costs.begin() + p.element;
      return fmt::format("cost.running[{}].weight.breaks[0]",
                         std::count_if(costs.begin(), end, [](const Cost& c) { return !c.terminal; }));
    }
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
    case Parameter::Kind::force_time:
    case Parameter::Kind::cost_time:
      return 0.1 * t_end;
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
    s += fmt::format(
        "[[cost.{}]]\nkind = \"{}\"\noutput = \"{}.{}{}\"\nweight = {}\ntarget = {}\n",
        c.terminal ? "terminal" : "running", c.terminal ? "value" : "square", name(c.point), kAxis[c.axis],
        c.rate ? "_dot" : "",
        c.from > 0
            ? fmt::format("{{ kind = \"piecewise\", breaks = [{}], coefficients = [[0], [{}]], joins = \"none\" }}",
                          num(c.from), num(c.weight))
            : num(c.weight),
        num(c.target));
  std::string list;
  for (const Parameter& p : parameters) list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", path(p));
  s += fmt::format("[run]\nt_end_s = {}\nrtol = 1e-8\nparameters = [{}]\n", num(t_end), list);
  return s;
}

}  // namespace costate::adversary
