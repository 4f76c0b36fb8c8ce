#include "costate/cycle/cycle_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/cycle/cycle_values.h"
#include "costate/cycle/return_map.h"
#include "costate/event/contact_gap.h"
#include "costate/event/named_event.h"
#include "costate/integrator/simulate.h"
#include "costate/mechanism/length_size.h"

namespace costate {

namespace {

constexpr int kLooks = 400;
constexpr double kReadAtStart = 1e-3;  // of a run of which the start alone is read
constexpr double kAtTheGround = 1e-4;  // of the coordinates: a contact that has just let go

/// Which force states nothing of the motion depends on, not even they themselves: no column of theirs along it; and
/// which costs do, where that is asked for.
struct StateUsers {
  std::vector<bool> passive, costed;
};
StateUsers users_of_states(const Problem& problem, const std::vector<double>& rho, bool of_costs) {
  const auto states = static_cast<std::size_t>(problem.mechanism->state_count());
  StateUsers users{std::vector<bool>(states, true), std::vector<bool>(states, false)};
  std::vector<bool>&passive = users.passive, &costed = users.costed;
  if (passive.empty()) return users;
  const ValuedProblem valued =
      has_cycle_values(problem) ? with_cycle_values(problem, rho, CycleValues::Ones()) : ValuedProblem{problem, rho};
  Assembly assembly(valued.problem.mechanism, valued.problem.parameters);
  assembly.set_parameters(valued.rho.data());
  ScalarGradient g;
  g.resize(assembly);
  const auto mark_costs = [&](const MechanismState& state, const auto& terms) {
    for (const auto& term : terms) {
      g.set_zero();
      term->add_gradient(state, assembly, 1, g);
      for (std::size_t i = 0; i < states; ++i)
        if (!(g.z[static_cast<Eigen::Index>(i)] == 0)) costed[i] = true;
    }
  };
  const auto mark = [&](const SparsePattern& pattern, const std::vector<double>& values) {
    for (int j = 0; j < pattern.cols; ++j)
      for (auto e = pattern.column_start[static_cast<std::size_t>(j)];
           e < pattern.column_start[static_cast<std::size_t>(j) + 1]; ++e)
        if (values[static_cast<std::size_t>(e)] != 0) passive[static_cast<std::size_t>(j)] = false;
  };
  Problem whole = problem;
  whole.ends_when.reset();
  whole.objective = {};
  const SolverOptions& s = problem.solver;
  std::vector<double> times;
  for (int k = 0; k <= kLooks; ++k) times.push_back(s.t_start + (s.t_end - s.t_start) * k / kLooks);
  try {
    simulate(whole, rho, times, [&](const MechanismState& state, System&) {
      assembly.calc_dynamics(state);
      assembly.calc_partials(state);
      mark(assembly.force_state(), assembly.Q_z);
      mark(assembly.state_state(), assembly.f_z);
      if (!of_costs) return;
      mark_costs(state, problem.objective.running);
      mark_costs(state, problem.objective.terminal);
    });
  } catch (const SolverError&) {  // what was seen before it fell over is enough
  }
  take_notices();
  return users;
}

/// They begin anew at each meeting, so that behind several a cost would see the last one's part of them.
void require_whole_states(const Mechanism& m, const CycleSettings& settings, const Section& section,
                          const StateUsers& users) {
  const std::vector<std::string> names = m.state_names();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool mode = std::any_of(section.modes().begin(), section.modes().end(),
                                  [&](const SectionMode& s) { return s.state == static_cast<int>(i); });
    if (users.passive[i] && users.costed[i] && !mode)
      throw CapabilityError(fmt::format(
          "The cost holds '{}', which begins anew whenever the section is met: over a cycle of {} meetings (count) it "
          "would be that since the last one. Where forces are periodic give the whole period as cycle.period_s; else "
          "take the integral of its rate, a running cost on the power.",
          names[i], settings.count));
  }
}

/// Where the scene starts just behind the impact that the section is, its contact closed: the contact that has let go,
/// still at the ground; else nothing.
std::string let_go_at_start(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho) {
  if (settings.event.empty()) return {};
  const Mechanism& m = *problem.mechanism;
  NamedEvent event;
  try {
    event = find_event(m, settings.event);
  } catch (const ModelError&) {  // the section says so
    return {};
  }
  if (!dynamic_cast<const UnilateralForce*>(event.guarded)) return {};
  Assembly assembly(problem.mechanism, problem.parameters);
  assembly.set_parameters(rho.data());
  const Start start = find_start(assembly, problem.solver.t_start, false);
  const StateView s = start.state(problem.solver.t_start);
  const std::vector<double> levers = coordinate_levers(m, length_size(m));
  std::string let_go;
  bool closed = false;
  for (std::size_t f = 0; f < m.forces().size(); ++f) {
    const Force& force = *m.forces()[f];
    const auto* contact = dynamic_cast<const UnilateralForce*>(&force);
    if (!contact || contact->closed_state() < 0) continue;
    const bool is_closed = s.z[m.state_offsets()[f] + contact->closed_state()] > 0.5;
    if (&force == event.force) closed = is_closed;
    if (is_closed || &force == event.force || !let_go.empty()) continue;
    if (std::abs(row_of(force, *contact, 0, s, assembly, nullptr).c0) <
        kAtTheGround * largest_coordinate(force, s, levers))
      let_go = force.path();
  }
  return closed ? let_go : "";
}

}  // namespace

CycleStart::CycleStart(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho) {
  const Mechanism& m = *problem.mechanism;
  if (m.starts_at_equilibrium())
    throw ModelError("start.equilibrium",
                     "A cycle is looked for among states that [start] gives: list as many coordinates as there are "
                     "degrees of freedom in 'given', without 'equilibrium'.");
  const std::string let_go = let_go_at_start(problem, settings, rho);
  const StateUsers users = users_of_states(problem, rho, settings.count > 1);
  auto section = std::make_unique<Section>(problem, settings, users.passive, let_go);
  require_whole_states(m, settings, *section, users);
  Problem first = problem;
  first.objective = {};
  // With a period, or just behind its impact, the motion begins where the scene has it.
  if (let_go.empty()) first.ends_when = section->first();
  if (settings.period_s)
    first.solver.t_end = first.solver.t_start + *settings.period_s;
  else if (!first.ends_when)
    first.solver.t_end = first.solver.t_start + kReadAtStart * (first.solver.t_end - first.solver.t_start);
  std::vector<std::pair<double, double>> modes;  // before and behind the first meeting
  bool seen = false;
  const auto read = [&](const MechanismState& s, System& system) {
    if (seen) return;
    seen = true;
    x_.resize(section->size());
    for (int i = 0; i < section->size(); ++i)
      x_[i] = section->coordinates()[static_cast<std::size_t>(i)].at_start->value(s, system.assembly());
    for (const SectionMode& mode : section->modes())
      modes.emplace_back(s.z[mode.state], mode.at_start->value(s, system.assembly()));
    positions_.assign(s.q, s.q + m.coordinate_count());
  };
  simulate(first, rho, {first.ends_when ? first.solver.t_end : first.solver.t_start}, read);
  for (std::size_t i = 0; i < modes.size(); ++i)
    if (const SectionMode& mode = section->modes()[i];
        section->closes() && !section->begin() && mode.closed && modes[i].first > 0.5 && modes[i].second < 0.5)
      section->set_let_go(m, mode.contact);
  section_ = std::move(section);
  // What travels begins where the scene has it, whatever the parameters: where along its way a cycle lies says nothing.
  const int c = section_->travelling(), carried = section_->carried().coordinate;
  if (c < 0 && carried < 0) return;
  std::vector<double> numbers = m.base_numbers();
  const int number = c >= 0 ? section_->coordinates()[static_cast<std::size_t>(c)].number
                            : m.coordinates()[static_cast<std::size_t>(carried)].position_number;
  const int goes = c >= 0 ? section_->coordinates()[static_cast<std::size_t>(c)].along : section_->carried().along;
  const double from = numbers[static_cast<std::size_t>(number)];
  const double at = c >= 0 ? x_[c] : positions_[static_cast<std::size_t>(carried)];
  problem.parameters.apply(rho.data(), numbers);
  const double angle = section_->angle(numbers);
  const double shift = (at - from) / along_way(goes, angle);
  for (int i = 0; i < section_->size(); ++i)
    x_[i] -= shift * along_way(section_->coordinates()[static_cast<std::size_t>(i)].along, angle);
  positions_ = section_->moved_back(positions_, shift, angle);
}

void settle(const ReturnMap& map, int rounds, Eigen::VectorXd& x, std::vector<double>& positions) {
  int k = 0;
  try {
    for (; k < rounds; ++k) {
      const MapValue v = map.evaluate(x, positions, MapDerivatives::none);
      x = v.next;
      positions = v.positions;
      map.onto_section(x, positions);
    }
  } catch (const ModelError& e) {
    if (k == 0) throw;
    throw SolverError(fmt::format(
        "{} So it is behind {} of the {} rounds that 'settle' waits, and not at the start. Let rounds begin where "
        "contacts do what they do at the start ([run] t_start_s, another section), or start on the cycle's side, with "
        "settle = 0.",
        e.what(), k, rounds));
  }
}

}  // namespace costate
