#include "costate/cycle/cycle_start.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"

namespace costate {

namespace {

constexpr int kLooks = 400;
constexpr double kReadAtStart = 1e-3;  // of a run of which the start alone is read

/// Which force states nothing depends on, not even they themselves: no column of theirs along the motion.
std::vector<bool> passive_states(const Problem& problem, const std::vector<double>& rho) {
  std::vector<bool> passive(static_cast<std::size_t>(problem.mechanism->state_count()), true);
  if (passive.empty()) return passive;
  Assembly assembly(problem.mechanism, problem.parameters);
  assembly.set_parameters(rho.data());
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
    });
  } catch (const SolverError&) {  // what was seen before it fell over is enough
  }
  take_notices();
  return passive;
}

}  // namespace

CycleStart::CycleStart(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho) {
  const Mechanism& m = *problem.mechanism;
  if (m.starts_at_equilibrium())
    throw ModelError("start.equilibrium",
                     "A cycle is looked for among states that [start] gives: list as many coordinates as there are "
                     "degrees of freedom in 'given', without 'equilibrium'.");
  section_ = std::make_unique<const Section>(problem, settings, passive_states(problem, rho));
  Problem first = problem;
  first.objective = {};
  const bool begins_there = !section_->end() || section_->starts_behind_impact();
  if (!begins_there) first.ends_when = section_->begin();
  // With a period, or behind an impact, the motion begins where the scene has it.
  if (settings.period_s)
    first.solver.t_end = first.solver.t_start + *settings.period_s;
  else if (begins_there)
    first.solver.t_end = first.solver.t_start + kReadAtStart * (first.solver.t_end - first.solver.t_start);
  bool seen = false;
  const auto read = [&](const MechanismState& s, System& system) {
    if (seen) return;
    seen = true;
    x_.resize(section_->size());
    for (int i = 0; i < section_->size(); ++i)
      x_[i] = section_->coordinates()[static_cast<std::size_t>(i)].at_start->value(s, system.assembly());
    positions_.assign(s.q, s.q + m.coordinate_count());
  };
  simulate(first, rho, {first.ends_when ? first.solver.t_end : first.solver.t_start}, read);
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

}  // namespace costate
