#include "costate/cycle/return_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/cycle/map_run.h"
#include "costate/formulation/law_joins.h"
#include "costate/level/fixed_times.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {
constexpr double kTwoPi = 6.283185307179586;
constexpr int kProjections = 8;
// Part of a cycle before its end in which no event but that of the section may happen.
constexpr double kBeforeEnd = 1e-6;
}  // namespace

ReturnMap::ReturnMap(const Problem& problem, const Section& section, std::vector<double> rho)
    : problem_(problem), section_(section), rho_(std::move(rho)) {
  problem_.check_values(rho_);
  problem_.ends_when.reset();
  problem_.cycle.reset();
  problem_.solver.confirm = false;
  std::vector<double> numbers = problem.mechanism->base_numbers();
  problem.parameters.apply(rho_.data(), numbers);
  const double t0 = problem.solver.t_start, t1 = problem.solver.t_end;
  require_fixed_times(*problem.mechanism, problem.parameters, numbers, t0, t1, true);
  require_joined_laws(*problem.mechanism, problem.parameters, numbers, t0, t1);
  if (section.settings().period_s) problem_.solver.t_end = t0 + *section.settings().period_s;
}

void ReturnMap::set_tolerance(double rtol, double atol) {
  problem_.solver.rtol = rtol;
  problem_.solver.atol = atol;
}

Problem ReturnMap::problem_at(const Eigen::VectorXd& x, const std::vector<double>& positions, bool vary_x,
                              bool vary_rho, std::vector<double>& values) const {
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
    if (vary_rho) {
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

MapValue ReturnMap::once(const Eigen::VectorXd& x, const std::vector<double>& positions, MapDerivatives derivatives,
                         bool last) const {
  const int d = section_.size(), np = derivatives == MapDerivatives::all ? static_cast<int>(rho_.size()) : 0;
  const bool differentiate = derivatives != MapDerivatives::none;
  if (has_samples(problem_.objective)) throw CapabilityError("Cycles do not take samples ([[cost.samples]]).");
  std::vector<double> values;
  Problem p = problem_at(x, positions, differentiate, derivatives == MapDerivatives::all, values);
  if (!last) p.objective.terminal.clear();  // counted where the cycle ends
  const MapRun run = run_to_section(p, values, section_, differentiate);
  MapValue r;
  r.time = run.t - p.solver.t_start;
  r.psi = run.psi;
  r.events = run.events;
  r.counters = run.counters;
  r.integrator = run.integrator;
  r.next = run.values;
  r.kappa = run.kappa;
  if (differentiate) {
    r.next_x = run.rows.topLeftCorner(d, d);
    r.next_rho = run.rows.block(0, d, d, np);
    r.time_x = run.rows.row(d).head(d);
    r.time_rho = run.rows.row(d).segment(d, np);
    r.psi_x = run.rows.row(d + 1).head(d);
    r.psi_rho = run.rows.row(d + 1).segment(d, np);
    r.travel_x.setZero(d);
    r.travel_rho.setZero(np);
  }
  // Back along the way, so that the coordinate that travels is where it was: travel = (P_c - x_c)/e_c.
  std::vector<double> numbers = problem_.mechanism->base_numbers();
  problem_.parameters.apply(rho_.data(), numbers);
  const double angle = section_.angle(numbers);
  if (const int c = section_.travelling(); c >= 0) {
    const auto way = [&](int along) { return along == 1 ? std::cos(angle) : std::sin(angle); };
    const auto turned = [&](int along) { return along == 1 ? -std::sin(angle) : std::cos(angle); };
    const int along = section_.coordinates()[static_cast<std::size_t>(c)].along;
    const double e = way(along);
    if (std::abs(e) < 0.1)
      throw ModelError("cycle.travel", fmt::format("'{}' is across the way that is travelled; name one along it.",
                                                   section_.settings().travel));
    r.travel = (r.next[c] - x[c]) / e;
    Eigen::RowVectorXd angle_rho = Eigen::RowVectorXd::Zero(np);
    if (differentiate) {
      if (section_.angle_number() >= 0)
        for (int j = 0; j < np; ++j)
          for (const auto& [number, factor] : problem_.parameters.parameters[static_cast<std::size_t>(j)].bindings)
            if (number == section_.angle_number()) angle_rho[j] += factor;
      r.travel_x = r.next_x.row(c) / e;
      r.travel_x[c] -= 1 / e;
      r.travel_rho = r.next_rho.row(c) / e - r.travel / e * turned(along) * angle_rho;
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
  for (int i = 0; i < d; ++i)
    if (section_.coordinates()[static_cast<std::size_t>(i)].turns)
      r.next[i] -= kTwoPi * std::round((r.next[i] - x[i]) / kTwoPi);
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
    sum.time += r.time;
    sum.travel += r.travel;
    sum.psi += r.psi;
    sum.counters += r.counters;
  }
  return sum;
}

namespace {

/// Sum of weight times output.
class WeightedOutputs final : public CostTerm {
 public:
  std::vector<std::pair<double, std::shared_ptr<const Output>>> parts;

  double value(const StateView& s, Assembly& assembly) const override {
    double sum = 0;
    for (const auto& [weight, output] : parts) sum += weight * output->value(s, assembly);
    return sum;
  }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    for (const auto& [weight, output] : parts) output->add_gradient(s, assembly, factor * weight, g);
  }
  bool needs_accelerations() const override { return false; }
};

}  // namespace

Problem ReturnMap::linear_problem(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                                  const Eigen::VectorXd& l, std::vector<double>& values, Eigen::VectorXd& more) const {
  Problem p = problem_at(x, positions, false, true, values);
  const auto& coordinates = section_.coordinates();
  Eigen::VectorXd weights = l;
  more.setZero(static_cast<Eigen::Index>(rho_.size()));
  // P_i - s e_i with s = (P_c - x_c)/e_c: the weight of P_c, and what the angle of e changes by itself.
  if (const int c = section_.travelling(); c >= 0) {
    std::vector<double> numbers = problem_.mechanism->base_numbers();
    problem_.parameters.apply(rho_.data(), numbers);
    const double angle = section_.angle(numbers);
    const auto way = [&](int along) { return along == 0 ? 0 : along == 1 ? std::cos(angle) : std::sin(angle); };
    const auto turned = [&](int along) { return along == 0 ? 0 : along == 1 ? -std::sin(angle) : std::cos(angle); };
    double le = 0, lt = 0;
    for (int i = 0; i < section_.size(); ++i) {
      const int along = coordinates[static_cast<std::size_t>(i)].along;
      le += l[i] * way(along);
      lt += l[i] * turned(along);
    }
    const int along = coordinates[static_cast<std::size_t>(c)].along;
    weights[c] -= le / way(along);
    const double by_angle = value.travel * (le * turned(along) / way(along) - lt);
    for (std::size_t j = 0; j < rho_.size(); ++j)
      for (const auto& [number, factor] : problem_.parameters.parameters[j].bindings)
        if (number == section_.angle_number()) more[static_cast<Eigen::Index>(j)] += factor * by_angle;
  }
  const auto term = std::make_shared<WeightedOutputs>();
  double kappa = value.kappa[section_.size() + 1];
  for (int i = 0; i < section_.size(); ++i) {
    if (weights[i] == 0) continue;
    term->parts.emplace_back(weights[i], coordinates[static_cast<std::size_t>(i)].at_end);
    kappa += weights[i] * value.kappa[i];
  }
  p.objective.terminal.push_back(term);
  if (section_.end()) {
    p.objective.terminal.push_back(end_term(*section_.end(), kappa));
    p.solver.t_end = p.solver.t_start + value.time;
    // What ends the cycle is not crossed by this run, whose own errors would decide whether it is.
    p.solver.events_until = p.solver.t_end - kBeforeEnd * value.time;
    for (std::size_t k = 0; k + 1 < value.events.size(); ++k)
      if (value.events[k].t >= p.solver.events_until)
        throw SolverError(
            fmt::format("'{}' happens at t = {:.9g} s, at the section itself ({:.9g} s): an adjoint cannot tell one "
                        "from the other. "
                        "Take a forward method, or another section.",
                        value.events[k].name, value.events[k].t, p.solver.t_end));
  }
  return p;
}

void ReturnMap::onto_section(Eigen::VectorXd& x, const std::vector<double>& positions) const {
  const auto section = section_.begin();
  if (!section) return;
  for (int k = 0; k < kProjections; ++k) {
    std::vector<double> values;
    const Problem p = problem_at(x, positions, true, false, values);
    Assembly assembly(p.mechanism, p.parameters);
    assembly.set_parameters(values.data());
    const Start start = find_start(assembly, p.solver.t_start, true);
    StateView s;
    s.t = p.solver.t_start;
    s.q = start.q.data();
    s.v = start.v.data();
    s.z = start.z.data();
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
    if (!std::isfinite(h) || best < 0)
      throw SolverError(fmt::format("The section '{}' is not met where the search begins.", section->output->name()));
    if (std::abs(h) <= 4 * std::numeric_limits<double>::epsilon() * std::max(size, most)) return;
    x[best] -= h / slope;
  }
}

ReturnMap::State ReturnMap::state(const Eigen::VectorXd& x, const std::vector<double>& positions) const {
  std::vector<double> values;
  const Problem p = problem_at(x, positions, false, false, values);
  Assembly assembly(p.mechanism, p.parameters);
  assembly.set_parameters(values.data());
  const Start s = find_start(assembly, p.solver.t_start, false);
  return {{s.q.data(), s.q.data() + s.q.size()},
          {s.v.data(), s.v.data() + s.v.size()},
          {s.z.data(), s.z.data() + s.z.size()}};
}

void ReturnMap::require_periodic(const Eigen::VectorXd& x, const std::vector<double>& positions) const {
  std::vector<double> values;
  const Problem p = problem_at(x, positions, false, true, values);
  Assembly assembly(p.mechanism, p.parameters);
  assembly.set_parameters(values.data());
  const State state = this->state(x, positions);
  const auto period = section_.settings().period_s;
  const double span = period ? *period : p.solver.t_end - p.solver.t_start;
  const std::vector<double> zero(static_cast<std::size_t>(assembly.n() + assembly.m()), 0.0);
  const int np = static_cast<int>(rho_.size());
  const auto terms = [&](double t) {
    StateView s;
    s.t = t;
    s.q = state.q.data();
    s.v = state.v.data();
    s.z = state.z.data();
    s.a = s.lambda = zero.data();
    assembly.calc_dynamics(s);
    assembly.calc_partials(s);
    Assembly::ParameterColumns c;
    assembly.resize(c);
    assembly.calc_parameter_columns(s, c);
    std::pair<std::vector<double>, Eigen::MatrixXd> r;
    for (const auto* part : {&assembly.Q, &assembly.phi, &assembly.phi_t, &assembly.bias, &assembly.zdot})
      r.first.insert(r.first.end(), part->begin(), part->end());
    r.second.resize(c.F.rows() + 3 * c.phi.rows() + c.f.rows(), np);
    if (np > 0)
      r.second << c.F.leftCols(np), c.phi.leftCols(np), c.phid.leftCols(np), c.phidd.leftCols(np), c.f.leftCols(np);
    return r;
  };
  constexpr double kSame = 1e-7;
  const std::vector<double> parts = {0.0, 0.1379, 0.3417, 0.5731, 0.8123};
  std::vector<decltype(terms(0.0))> now, then;
  double size = 0;
  Eigen::VectorXd column_size = Eigen::VectorXd::Zero(np);
  for (const double part : parts) {
    const double t = p.solver.t_start + part * span;
    now.push_back(terms(t));
    then.push_back(terms(t + (period ? span : 0.4391 * span)));
    for (const auto* side : {&now.back(), &then.back()}) {
      for (const double f : side->first) size = std::max(size, std::abs(f));
      for (int j = 0; j < np; ++j)
        if (side->second.rows() > 0)
          column_size[j] = std::max(column_size[j], side->second.col(j).cwiseAbs().maxCoeff());
    }
  }
  bool depends = false;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    double most = 0;
    for (std::size_t i = 0; i < now[k].first.size(); ++i) {
      most = std::max(most, std::abs(now[k].first[i] - then[k].first[i]));
      depends = depends || std::abs(now[k].first[i] - now[0].first[i]) > kSame * size;
    }
    if (most > kSame * size)
      throw ModelError(period ? "cycle.period_s" : "cycle.section",
                       period ? fmt::format("Forces or constraints at t = {:g} s and {:g} s later differ by {:.2g} of "
                                            "what they are: this is no period of theirs.",
                                            p.solver.t_start + parts[k] * span, span, most / size)
                              : "Forces or constraints depend on time, so that a state at the section does not say how "
                                "the motion goes on. Give 'period_s' in the place of 'section'.");
    for (int j = 0; period && j < np; ++j)
      if (column_size[j] > 0 &&
          (now[k].second.col(j) - then[k].second.col(j)).cwiseAbs().maxCoeff() > kSame * column_size[j])
        throw ModelError("cycle.period_s",
                         fmt::format("Parameter '{}' changes the period of the forces, while 'period_s' is a fixed "
                                     "number: the cycle has no derivative by it. Leave it out of the parameters.",
                                     problem_.parameters.parameters[static_cast<std::size_t>(j)].name));
  }
  if (period && !depends)
    throw ModelError("cycle.period_s",
                     "Nothing here depends on time: the period of a free motion is its own. Give 'section' in the "
                     "place of 'period_s'.");
}

}  // namespace costate
