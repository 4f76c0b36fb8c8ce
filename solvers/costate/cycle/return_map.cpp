#include "costate/cycle/return_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/cycle/map_run.h"
#include "costate/objective/sampled_cost.h"
#include "costate/problem/differentiable_laws.h"

namespace costate {

namespace {
constexpr double kTwoPi = 6.283185307179586;
constexpr int kProjections = 8;
}  // namespace

ReturnMap::ReturnMap(const Problem& problem, const Section& section, std::vector<double> rho, int last)
    : problem_(problem), section_(section), rho_(std::move(rho)), last_(last) {
  problem_.check_values(rho_);
  problem_.ends_when.reset();
  problem_.cycle.reset();
  problem_.solver.confirm = false;
  require_differentiable_laws(problem, rho_, true);
  if (section.settings().period_s) problem_.solver.t_end = problem.solver.t_start + *section.settings().period_s;
}

void ReturnMap::set_tolerance(double rtol, double atol) {
  problem_.solver.rtol = rtol;
  problem_.solver.atol = atol;
}

Problem ReturnMap::problem_at(const Eigen::VectorXd& x, const std::vector<double>& positions, bool vary_x, int varied,
                              std::vector<double>& values) const {
  Problem p = problem_;
  const Mechanism& m = *p.mechanism;
  Parameter rest;
  rest.name = "numbers that stay";
  rest.value = 1;
  std::vector<bool> taken(m.numbers().size(), false);
  std::vector<Parameter> parameters;
  for (int i = 0; i < section_.size(); ++i) {
    const SectionCoordinate& c = section_.coordinates()[static_cast<std::size_t>(i)];
    taken[static_cast<std::size_t>(c.number)] = true;
    if (!vary_x) {
      rest.bindings.emplace_back(c.number, x[i]);
      continue;
    }
    Parameter of;
    of.name = c.name;
    of.bindings = {{c.number, 1.0}};
    of.value = x[i];
    parameters.push_back(of);
  }
  for (std::size_t j = 0; j < rho_.size(); ++j) {
    Parameter of = problem_.parameters.parameters[j];
    // What a parameter says of the start is overruled by x.
    std::erase_if(of.bindings,
                  [&](const auto& b) { return section_.start_numbers()[static_cast<std::size_t>(b.first)]; });
    of.value = rho_[j];
    if (static_cast<int>(j) >= this->parameters() - varied) {
      parameters.push_back(of);
      continue;
    }
    for (const auto& [number, factor] : of.bindings) rest.bindings.emplace_back(number, factor * rho_[j]);
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const int number = m.coordinates()[i].position_number;
    if (!taken[static_cast<std::size_t>(number)]) rest.bindings.emplace_back(number, positions[i]);
  }
  if (!rest.bindings.empty()) parameters.push_back(rest);
  p.parameters.parameters = parameters;
  values = p.parameters.values();
  return p;
}

double ReturnMap::angle(int varied, Eigen::RowVectorXd& angle_rho) const {
  std::vector<double> numbers = problem_.mechanism->base_numbers();
  problem_.parameters.apply(rho_.data(), numbers);
  angle_rho.setZero(varied);
  for (int j = 0; j < varied && section_.angle_number() >= 0; ++j)
    for (const auto& [number, factor] :
         problem_.parameters.parameters[static_cast<std::size_t>(parameters() - varied + j)].bindings)
      if (number == section_.angle_number()) angle_rho[j] += factor;
  return section_.angle(numbers);
}

double ReturnMap::carried_start(const Problem& problem, const std::vector<double>& values,
                                Eigen::RowVectorXd* by) const {
  Assembly assembly(problem.mechanism, problem.parameters);
  assembly.set_parameters(values.data());
  const Start start = find_start(assembly, problem.solver.t_start, by != nullptr);
  const int i = section_.carried().coordinate;
  if (by) *by = start.q_rho.row(i);
  return start.q[i];
}

MapValue ReturnMap::once(const Eigen::VectorXd& x, const std::vector<double>& positions, MapDerivatives derivatives,
                         bool last) const {
  const int d = section_.size();
  const int np = derivatives == MapDerivatives::all ? parameters() : derivatives == MapDerivatives::last ? last_ : 0;
  const bool carries = section_.carried().coordinate >= 0;
  const bool differentiate = derivatives != MapDerivatives::none;
  if (has_samples(problem_.objective)) throw CapabilityError("Cycles do not take samples ([[cost.samples]]).");
  std::vector<double> values;
  Problem p = problem_at(x, positions, differentiate, np, values);
  if (!last) p.objective.terminal.clear();  // counted where the cycle ends
  const MapRun run = run_to_section(p, values, section_, differentiate);
  MapValue r;
  r.time = run.t - p.solver.t_start;
  r.psi = run.psi;
  r.events = run.events;
  r.modes = run.modes;
  r.counters = run.counters;
  r.integrator = run.integrator;
  r.next = run.values.head(d);
  r.kappa = run.kappa;
  if (differentiate) {
    r.next_x = run.rows.topLeftCorner(d, d);
    r.next_rho = run.rows.block(0, d, d, np);
    const auto time = run.values.size();
    r.time_x = run.rows.row(time).head(d);
    r.time_rho = run.rows.row(time).segment(d, np);
    r.psi_x = run.rows.row(time + 1).head(d);
    r.psi_rho = run.rows.row(time + 1).segment(d, np);
    r.travel_x.setZero(d);
    r.travel_rho.setZero(np);
  }
  // Back along the way, so that the coordinate that travels is where it was: travel = (P_c - x_c)/e_c.
  Eigen::RowVectorXd angle_rho;
  const double angle = this->angle(np, angle_rho);
  if (const int c = section_.travelling(); c >= 0 || carries) {
    const auto way = [&](int along) { return along_way(along, angle); };
    const auto turned = [&](int along) { return along_way_angle(along, angle); };
    const int along = carries ? section_.carried().along : section_.coordinates()[static_cast<std::size_t>(c)].along;
    const double e = way(along);
    if (std::abs(e) < 0.1)
      throw ModelError("cycle.travel", fmt::format("'{}' is across the way that is travelled; name one along it.",
                                                   section_.settings().travel));
    Eigen::RowVectorXd begins;
    const double from = carries ? carried_start(p, values, differentiate ? &begins : nullptr) : x[c];
    r.travel = ((carries ? run.values[d] : r.next[c]) - from) / e;
    if (differentiate) {
      Eigen::RowVectorXd row = run.rows.row(carries ? d : c).head(d + np);
      if (carries)
        row -= begins.head(d + np);
      else
        row[c] -= 1;
      r.travel_x = row.head(d) / e;
      r.travel_rho = row.tail(np) / e - r.travel / e * turned(along) * angle_rho;
    }
    for (int i = 0; i < d; ++i) {
      const int a = section_.coordinates()[static_cast<std::size_t>(i)].along;
      if (a == 0) continue;
      r.next[i] -= r.travel * way(a);
      if (!differentiate) continue;
      r.next_x.row(i) -= way(a) * r.travel_x;
      r.next_rho.row(i) -= way(a) * r.travel_rho + r.travel * turned(a) * angle_rho;
    }
  }
  r.positions = section_.positions_behind(run.positions.data(), r.travel, angle);
  return r;
}

MapValue ReturnMap::evaluate(const Eigen::VectorXd& x, const std::vector<double>& positions,
                             MapDerivatives derivatives) const {
  const int count = section_.settings().count;
  MapValue sum = once(x, positions, derivatives, count == 1);
  for (int k = 2; k <= count; ++k) {
    const MapValue r = once(sum.next, sum.positions, derivatives, k == count);
    if (derivatives != MapDerivatives::none) {
      const auto chain = [&](Eigen::RowVectorXd& x_, Eigen::RowVectorXd& rho_, const Eigen::RowVectorXd& then_x,
                             const Eigen::RowVectorXd& then_rho) {
        x_ += then_x * sum.next_x;
        rho_ += then_x * sum.next_rho + then_rho;
      };
      chain(sum.time_x, sum.time_rho, r.time_x, r.time_rho);
      chain(sum.travel_x, sum.travel_rho, r.travel_x, r.travel_rho);
      chain(sum.psi_x, sum.psi_rho, r.psi_x, r.psi_rho);
      sum.next_rho = (r.next_x * sum.next_rho + r.next_rho).eval();
      sum.next_x = (r.next_x * sum.next_x).eval();
    }
    for (RunEvent e : r.events) {
      e.t += sum.time;
      sum.events.push_back(e);
    }
    sum.next = r.next;
    sum.positions = r.positions;
    sum.modes = r.modes;
    sum.time += r.time;
    sum.travel += r.travel;
    sum.psi += r.psi;
    sum.counters += r.counters;
  }
  sum.turned.setZero(x.size());
  for (int i = 0; i < section_.size(); ++i)
    if (section_.coordinates()[static_cast<std::size_t>(i)].turns)
      sum.turned[i] = kTwoPi * std::round((sum.next[i] - x[i]) / kTwoPi);
  sum.next -= sum.turned;
  return sum;
}

void ReturnMap::onto_section(Eigen::VectorXd& x, const std::vector<double>& positions) const {
  const auto section = section_.begin();
  if (!section) return;
  for (int k = 0; k < kProjections; ++k) {
    std::vector<double> values;
    const Problem p = problem_at(x, positions, true, 0, values);
    Assembly assembly(p.mechanism, p.parameters);
    assembly.set_parameters(values.data());
    const Start start = find_start(assembly, p.solver.t_start, true);
    const StateView s = start.state(p.solver.t_start);
    const double h = section->output->value(s, assembly) - section->level_in(assembly);
    ScalarGradient g;
    g.resize(assembly);
    g.set_zero();
    section->output->add_gradient(s, assembly, 1, g);
    Eigen::Index best = -1;
    double most = 0, slope = 0, size = 0;
    for (const int i : section_.free()) {
      const double d = g.q.dot(start.q_rho.col(i)) + g.v.dot(start.v_rho.col(i)) + g.z.dot(start.z_rho.col(i));
      size = std::max(size, std::abs(d * x[i]));
      if (std::abs(d) <= most) continue;
      most = std::abs(d);
      best = i;
      slope = d;
    }
    if (!std::isfinite(h) || best < 0) {
      const std::string contact = sticks_at_place(state(x, positions));
      throw SolverError(
          fmt::format("The section '{}' is not met where the search begins.{}", section->output->name(),
                      contact.empty() ? ""
                                      : fmt::format(" {} sticks there at its along_m, which the search does not vary: "
                                                    "leave that out and let [start] give the coordinate in 'given'.",
                                                    contact)));
    }
    if (std::abs(h) <= 4 * std::numeric_limits<double>::epsilon() * std::max(size, most)) return;
    x[best] -= h / slope;
  }
}

Problem ReturnMap::motion_from(const Eigen::VectorXd& x, const std::vector<double>& positions,
                               std::vector<double>& values) const {
  return problem_at(x, positions, false, parameters(), values);
}

ReturnMap::State ReturnMap::state(const Eigen::VectorXd& x, const std::vector<double>& positions) const {
  std::vector<double> values;
  const Problem p = problem_at(x, positions, false, 0, values);
  Assembly assembly(p.mechanism, p.parameters);
  assembly.set_parameters(values.data());
  const Start s = find_start(assembly, p.solver.t_start, false);
  return {{s.q.data(), s.q.data() + s.q.size()},
          {s.v.data(), s.v.data() + s.v.size()},
          {s.z.data(), s.z.data() + s.z.size()}};
}

}  // namespace costate
