#include "balances.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <regex>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/all_outputs.h"
#include "costate/problem/scene_problem.h"
#include "motions.h"

namespace costate::adversary {

namespace {

constexpr double kRtol = 1e-8;
// A balance holds along every motion, however far that is from the right one: steps' own errors are all that is in it,
// some hundred to a thousand tolerances of the terms' size.
constexpr double kAllowed = 1e-4;
constexpr double kFixed = 100;  // times as much by fixed steps of second order
// Absolute errors of velocities, in the mechanism's lengths a second where these are below 1 m, as of psi some 30
// absolute tolerances (solvers/costate/sensitivity/confirmation.cpp): a motion of next to no speed has no digits.
constexpr double kAbsolute = 30 * kRtol;
constexpr double kGives = 1e-7;  // soft rows, of their lengths
constexpr int kPanels = 40;
constexpr double kInside = 1e-9;  // of the span: laws' corners are left to the neighbours

/// Gauss and Legendre's points of order ten on [0, 1].
constexpr int kNodes = 5;
constexpr double kNode[kNodes] = {0.046910077030668, 0.230765344947158, 0.5, 0.769234655052842, 0.953089922969332},
                 kWeight[kNodes] = {0.118463442528095, 0.239314335249683, 0.284444444444444, 0.239314335249683,
                                    0.118463442528095};

/// Panels, and their halves, between the breaks.
struct Panel {
  double begin, end;
};

std::vector<Panel> panels(double t_end, std::vector<double> breaks) {
  breaks.push_back(0);
  breaks.push_back(t_end);
  std::erase_if(breaks, [&](double t) { return t < 0 || t > t_end; });
  std::sort(breaks.begin(), breaks.end());
  std::vector<Panel> list;
  const double shy = kInside * t_end;
  for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
    const double from = breaks[k] + shy, to = breaks[k + 1] - shy;
    if (to - from < 10 * shy) continue;
    const int n = 2 + static_cast<int>(kPanels * (to - from) / t_end);
    for (int i = 0; i < n; ++i) list.push_back({from + (to - from) * i / n, from + (to - from) * (i + 1) / n});
  }
  return list;
}

/// Values of a motion at any of the times that were asked for.
class Record {
 public:
  Record(const std::string& scene, const std::string& formulation, const std::string& integrator,
         const std::vector<Panel>& list) {
    Problem p = make_problem(Scene::parse(scene, "adversary.toml"));
    p.formulation = formulation;
    p.solver.integrator = integrator;
    p.solver.rtol = kRtol;
    const auto outputs = make_all_outputs(*p.mechanism);
    for (std::size_t o = 0; o < outputs.size(); ++o) index_[outputs[o]->name()] = o;
    std::vector<double> times;
    for (const Panel& panel : list) {
      times.push_back(panel.begin);
      times.push_back(panel.end);
      const double middle = 0.5 * (panel.begin + panel.end);
      for (const double node : kNode) {
        times.push_back(panel.begin + node * (panel.end - panel.begin));
        times.push_back(panel.begin + node * (middle - panel.begin));
        times.push_back(middle + node * (panel.end - middle));
      }
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    take_notices();
    simulate(p, p.parameters.values(), times, [&](const MechanismState& s, System& system) {
      std::vector<double>& row = rows_[s.t];
      for (const auto& o : outputs) row.push_back(o->value(s, system.assembly()));
    });
    for (const auto& sentence : take_notices()) said += sentence + " ";
    for (const Number& n : p.mechanism->numbers())
      if (n.path.size() > 7 && n.path.compare(n.path.size() - 7, 7, "mass_kg") == 0) mass += n.value;
  }

  double at(double t, const std::string& name) const {
    const auto found = index_.find(name);
    if (found == index_.end()) return 0;
    const auto row = rows_.lower_bound(t - 1e-12);
    return row == rows_.end() ? NAN : row->second[found->second];
  }
  const std::map<double, std::vector<double>>& rows() const { return rows_; }
  std::vector<std::string> ending_in(const std::string& end) const {
    std::vector<std::string> list;
    for (const auto& [name, o] : index_)
      if (name.size() > end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0)
        list.push_back(name);
    return list;
  }
  std::string said;
  double mass = 0;  // of all parts

 private:
  std::map<std::string, std::size_t> index_;
  std::map<double, std::vector<double>> rows_;
};

struct Integral {
  double value = 0, unsure = 0;
};

/// By the panel's halves; what the whole panel differs by is what it does not settle.
template <class F>
Integral integral(const Panel& panel, const F& f) {
  double whole = 0, halves = 0, length = panel.end - panel.begin, middle = 0.5 * (panel.begin + panel.end);
  for (int i = 0; i < kNodes; ++i) {
    whole += kWeight[i] * length * f(panel.begin + kNode[i] * length);
    halves += kWeight[i] * (middle - panel.begin) * f(panel.begin + kNode[i] * (middle - panel.begin));
    halves += kWeight[i] * (panel.end - middle) * f(middle + kNode[i] * (panel.end - middle));
  }
  return {halves, std::abs(whole - halves)};
}

/// The truss at one sample, by its own numbers and what was stored of positions, velocities, accelerations and forces.
struct Moment {
  Moment(const Truss& t, const Record& record, double time) : truss(t) {
    const std::size_t n = t.points.size();
    for (auto* list : {&x, &v, &a, &rest}) list->assign(2 * n, 0);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < 2; ++k) {
        const std::string name = t.points[i].name + "." + (k == 0 ? "x" : "y");
        const bool ground = t.points[i].ground;
        x[2 * i + k] = ground ? t.points[i].x[k] : record.at(time, name);
        v[2 * i + k] = ground ? 0 : record.at(time, name + "_dot");
        a[2 * i + k] = ground ? 0 : record.at(time, name + "_ddot");
        add(i, k, t.points[i].mass * (a[2 * i + k] - t.gravity[k]));
        force = std::max(force, t.points[i].mass * std::abs(t.gravity[k]));
        kinetic += t.points[i].mass * v[2 * i + k] * v[2 * i + k] / 2;
        potential -= t.points[i].mass * t.gravity[k] * x[2 * i + k];
      }
    for (const Bar& b : t.bars) {
      const auto [d, rate] = between(b.a, b.b);
      const double length = std::hypot(d[0], d[1]), tension = record.at(time, b.name + ".tension");
      torn = std::max(torn, std::abs(length / b.length - 1));
      const auto i = static_cast<std::size_t>(b.a), j = static_cast<std::size_t>(b.b);
      for (std::size_t k = 0; k < 2; ++k) {
        const double ai = a[2 * i + k], aj = a[2 * j + k], vi = v[2 * i + k], vj = v[2 * j + k];
        // A uniform bar moves linearly between its ends.
        add(i, k, b.mass * (ai / 3 + aj / 6 - t.gravity[k] / 2) - tension * d[k] / length);
        add(j, k, b.mass * (aj / 3 + ai / 6 - t.gravity[k] / 2) + tension * d[k] / length);
        force = std::max(force, std::abs(tension * d[k] / length));
        kinetic += b.mass * (vi * vi + vi * vj + vj * vj) / 6;
        potential -= b.mass * t.gravity[k] * (x[2 * i + k] + x[2 * j + k]) / 2;
      }
    }
    for (const Spring& s : t.springs) {
      const auto [d, w] = between(s.a, s.b);
      const double length = std::hypot(d[0], d[1]), rate = (d[0] * w[0] + d[1] * w[1]) / length;
      const double damping = s.kinked && rate > 0 ? s.damping_out : s.damping;
      const double tension = s.stiffness * (length - s.length) + damping * rate;
      for (std::size_t k = 0; k < 2; ++k) {
        add(static_cast<std::size_t>(s.a), k, -tension * d[k] / length);
        add(static_cast<std::size_t>(s.b), k, tension * d[k] / length);
      }
      elastic += s.stiffness * (length - s.length) * (length - s.length) / 2;
      power -= damping * rate * rate;
    }
    for (const Force& f : t.forces) {
      const auto i = static_cast<std::size_t>(f.point), k = static_cast<std::size_t>(f.axis);
      add(i, k, -f.law.value(time));
      power += f.law.value(time) * v[2 * i + k];
    }
    for (const Driver& d : t.drivers) {
      const double given = record.at(time, d.name + ".force");
      add(static_cast<std::size_t>(d.point), static_cast<std::size_t>(d.axis), -given);
      power += given * d.law.rate(time);
    }
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < 2 && !t.points[i].ground; ++k)
        unbalanced = std::max(unbalanced, std::abs(rest[2 * i + k]));
  }
  double energy() const { return kinetic + potential + elastic; }

  const Truss& truss;
  std::vector<double> x, v, a, rest;
  double kinetic = 0, potential = 0, elastic = 0, power = 0, torn = 0, force = 0, unbalanced = 0;

 private:
  void add(std::size_t i, std::size_t k, double f) {
    rest[2 * i + k] += f;
    if (!truss.points[i].ground) force = std::max(force, std::abs(f));
  }
  std::pair<std::vector<double>, std::vector<double>> between(int a_, int b_) const {
    const auto i = static_cast<std::size_t>(a_), j = static_cast<std::size_t>(b_);
    return {{x[2 * j] - x[2 * i], x[2 * j + 1] - x[2 * i + 1]}, {v[2 * j] - v[2 * i], v[2 * j + 1] - v[2 * i + 1]}};
  }
};

/// What absolute errors of velocities make of a kinetic energy, as a size whose kAllowed that is.
double known_energy(double kinetic, double mass, double length) {
  const double v = kAbsolute * std::min(1.0, length);
  return (std::sqrt(2 * kinetic * mass) * v + mass * v * v) / kAllowed;
}

void judge(Finding& f, std::string said, const std::function<std::string()>& more,
           std::vector<std::pair<std::string, double>> errors, const std::string& integrator) {
  const double allowed = has_fixed_steps(integrator) ? kFixed * kAllowed : kAllowed;
  const auto worst = *std::max_element(errors.begin(), errors.end(),
                                       [](const auto& a, const auto& b) { return !(b.second <= a.second); });
  f.error = worst.second;
  if (!(f.error <= allowed) && said.empty()) said = more();
  f.outcome = f.error <= allowed ? Outcome::agreed : !said.empty() ? Outcome::warned : Outcome::wrong;
  f.message = worst.first + (said.empty() ? "" : "; warned: " + said);
}

/// Where bumps begin and end: panels have to have their ends there, or the quadrature misses short ones.
std::vector<double> ends_of_bumps(const std::string& scene) {
  static const std::regex bump(R"~(start_m = ([0-9.e+-]+), length_m = ([0-9.e+-]+))~");
  std::vector<double> breaks;
  for (std::sregex_iterator i(scene.begin(), scene.end(), bump), end; i != end; ++i) {
    breaks.push_back(std::stod((*i)[1]));
    breaks.push_back(breaks.back() + std::stod((*i)[2]));
  }
  return breaks;
}

}  // namespace

std::vector<Finding> run_balances(const Truss& t, const std::vector<std::pair<std::string, std::string>>& runs) {
  std::vector<double> breaks;
  for (const auto* laws : {"forces", "drivers"}) {
    const auto add = [&](const TimeLaw& law) {
      for (const double b : law.breaks()) breaks.push_back(b);
    };
    if (std::string(laws) == "forces")
      for (const Force& f : t.forces) add(f.law);
    else
      for (const Driver& d : t.drivers) add(d.law);
  }
  const std::vector<Panel> list = panels(t.t_end, breaks);
  std::vector<Finding> findings;
  for (const auto& [formulation, integrator] : runs)
    findings.push_back(found(formulation + " x " + integrator, [&, &formulation = formulation,
                                                                &integrator = integrator](Finding& f) {
      const Record record(t.scene(), formulation, integrator, list);
      double force = 0, unbalanced = 0, torn = 0, energy = 0, told = 0, first = 0, lost = 0, unsure = 0;
      bool begun = false;
      const double datum = Moment(t, record, record.rows().begin()->first).potential;
      for (const auto& [time, row] : record.rows()) {
        const Moment m(t, record, time);
        force = std::max(force, m.force);
        unbalanced = std::max(unbalanced, m.unbalanced);
        torn = std::max(torn, m.torn);
        energy = std::max(energy, m.kinetic + m.elastic + std::abs(m.potential - datum));
        const double apart = record.at(time, "energy.total") - m.energy();
        if (!begun) first = apart;
        begun = true;
        told = std::max(told, std::abs(apart - first));
      }
      double sum = 0, before = list.front().begin;
      for (const Panel& panel : list) {
        // Behind a corner of a law the balance begins anew: drivers may have struck.
        if (panel.begin - before > 0.5 * kInside * t.t_end) sum = 0;
        before = panel.end;
        const Integral work = integral(panel, [&](double time) { return Moment(t, record, time).power; });
        const Integral traffic = integral(panel, [&](double time) { return std::abs(Moment(t, record, time).power); });
        energy = std::max(energy, traffic.value);
        sum += Moment(t, record, panel.end).energy() - Moment(t, record, panel.begin).energy() - work.value;
        lost = std::max(lost, std::abs(sum));
        unsure += work.unsure;
      }
      double length = 0;
      for (const Bar& b : t.bars) length = std::max(length, b.length);
      energy += known_energy(energy, record.mass, length > 0 ? length : 1);
      // Soft rows give by some parts of the lengths, and forces do work on that.
      if (!find_formulation(formulation).exact_constraints()) energy += force * kGives * length / kAllowed;
      if (!(energy > 0)) energy = 1;
      if (!(force > 0)) force = 1;
      judge(
          f, record.said, [&] { return said_by_confirmation(t.scene(), formulation, integrator, kRtol); },
          {{"momentum", unbalanced / force},
           {"lengths of bars", torn},
           {"energy.total", told / energy},
           {"energy and work", std::max(0.0, lost - 10 * unsure) / energy}},
          integrator);
    }));
  return findings;
}

std::vector<Finding> run_created_energy(const std::string& scene,
                                        const std::vector<std::pair<std::string, std::string>>& runs) {
  // What tyres have in their springs, and what roads that move give them, no output tells.
  if (scene.find("\n[tyre.") != std::string::npos) return {{Outcome::unjudged, "tyres", 0, "energy of tyres"}};
  const Problem p = make_problem(Scene::parse(scene, "adversary.toml"));
  const std::vector<Panel> list = panels(p.solver.t_end, ends_of_bumps(scene));
  // A driver along a path reports its force alone.
  static const std::regex pilot(R"~(\[path_driver\.([A-Za-z0-9_]+)\][^\[]*coordinate = "([A-Za-z0-9_.]+)")~");
  std::vector<std::pair<std::string, std::string>> pilots;
  for (std::sregex_iterator i(scene.begin(), scene.end(), pilot), end; i != end; ++i)
    pilots.emplace_back((*i)[1].str() + ".force", (*i)[2].str() + "_dot");
  std::vector<Finding> findings;
  for (const auto& [formulation, integrator] : runs)
    findings.push_back(
        found(formulation + " x " + integrator, [&, &formulation = formulation, &integrator = integrator](Finding& f) {
          const Record record(scene, formulation, integrator, list);
          const auto powers = record.ending_in(".power");
          double size = 0, created = 0, sum = 0, lowest = 0, low = HUGE_VAL, high = -HUGE_VAL;
          for (const Panel& panel : list) {
            Integral work;
            const auto add = [&](const Integral& one) {
              work.value += one.value;
              work.unsure += one.unsure;
              size = std::max(size, std::abs(one.value));
            };
            for (const auto& name : powers) add(integral(panel, [&](double t) { return record.at(t, name); }));
            for (const auto& [force, rate] : pilots)
              add(integral(panel, [&, &a = force, &b = rate](double t) { return record.at(t, a) * record.at(t, b); }));
            for (const double t : {panel.begin, panel.end}) {
              low = std::min(low, record.at(t, "energy.total"));
              high = std::max(high, record.at(t, "energy.total"));
              size = std::max({size, record.at(t, "energy.kinetic"), high - low});
            }
            sum += record.at(panel.end, "energy.total") - record.at(panel.begin, "energy.total") - work.value -
                   10 * work.unsure;
            lowest = std::min(lowest, sum);
            created = std::max(created, sum - lowest);
          }
          size += known_energy(size, record.mass, 1);
          if (!(size > 0)) size = 1;
          judge(
              f, record.said, [&] { return said_by_confirmation(scene, formulation, integrator, kRtol); },
              {{fmt::format("created {:.3g} J of {:.3g}", created, size), created / size}}, integrator);
        }));
  return findings;
}

}  // namespace costate::adversary
