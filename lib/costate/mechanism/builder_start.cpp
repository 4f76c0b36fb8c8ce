// What a mechanism starts with: given positions, velocities and rates, and the initial values of force states.
#include <fmt/format.h>

#include <unordered_set>

#include "costate/base/error.h"
#include "costate/mechanism/builder.h"

namespace costate {

void MechanismBuilder::add_start_group(const std::string& name, std::vector<std::string> positions,
                                       std::vector<std::string> velocities) {
  if (!start_groups_.emplace(name, StartGroup{std::move(positions), std::move(velocities)}).second)
    throw ModelError("", fmt::format("There are two bodies named '{}'.", name));
}

void MechanismBuilder::add_rate(GivenStart rate) {
  const std::string name = rate.name;
  if (!rates_.emplace(name, std::move(rate)).second)
    throw ModelError("", fmt::format("There are two rates named '{}'.", name));
}

void MechanismBuilder::give_position(const std::string& name) {
  if (const auto group = start_groups_.find(name); group != start_groups_.end()) {
    for (const auto& member : group->second.positions) give_position(member);
    return;
  }
  if (rates_.count(name))
    throw ModelError("", fmt::format("'{}' is a rate; it can stand in given_velocities, not among positions.", name));
  const int i = m_->coordinate(name);
  if (!positions_given_.insert(i).second) throw ModelError("", fmt::format("Coordinate '{}' is given twice.", name));
  m_->given_positions_.push_back({i, m_->coordinates_[i].position_number, m_->coordinates_[i].name});
}

void MechanismBuilder::give_velocity(const std::string& name) {
  if (const auto group = start_groups_.find(name); group != start_groups_.end()) {
    for (const auto& member : group->second.velocities) give_velocity(member);
    return;
  }
  if (const auto rate = rates_.find(name); rate != rates_.end()) {
    if (!rates_given_.insert(name).second) throw ModelError("", fmt::format("Velocity '{}' is given twice.", name));
    m_->given_velocities_.push_back(rate->second);
    return;
  }
  const int i = m_->coordinate(name);
  if (!velocities_given_.insert(i).second) throw ModelError("", fmt::format("Velocity '{}' is given twice.", name));
  m_->given_velocities_.push_back({i, m_->coordinates_[i].velocity_number, m_->coordinates_[i].name});
  if (const auto at = follows_.find(i); at != follows_.end())
    for (const int number : at->second)
      fix_number(number,
                 fmt::format("the start gives the velocity of '{}', which is that of the angular velocity at this "
                             "orientation; list the angular velocity in given_velocities (omega_x, omega_y, omega_z).",
                             name));
}

std::vector<std::string> MechanismBuilder::initial_state_paths() const {
  std::vector<std::string> paths;
  for (const auto& f : m_->forces_)
    for (int i = 0; i < f->states(); ++i)
      if (const int local = f->initial_state_number(i); local >= 0)
        paths.push_back(m_->numbers_[f->numbers()[local]].path);
  return paths;
}

void MechanismBuilder::hold_or_balance_states() {
  Mechanism& m = *m_;
  m.held_states_.assign(static_cast<std::size_t>(m.state_count_), true);
  if (!m.starts_at_equilibrium_) return;
  for (std::size_t k = 0; k < m.forces_.size(); ++k)
    for (int i = 0; i < m.forces_[k]->states(); ++i) {
      const int local = m.forces_[k]->initial_state_number(i);
      const int number = local >= 0 ? m.forces_[k]->numbers()[local] : -1;
      if (held_states_.count(number)) continue;
      m.held_states_[static_cast<std::size_t>(m.state_offsets_[k] + i)] = false;
      if (number >= 0 && m.numbers_[number].fixed_because.empty())
        m.numbers_[number].fixed_because =
            "the start finds this force state by equilibrium; write its initial value in the scene to hold it there";
    }
}

void MechanismBuilder::give_what_is_free() {
  Mechanism& m = *m_;
  if (m.starts_at_equilibrium_ || !m.given_positions_.empty() || !m.given_velocities_.empty()) return;
  std::vector<std::vector<const Constraint*>> on(static_cast<std::size_t>(m.coordinate_count()));
  for (const auto& c : m.constraints_)
    for (const int i : c->coordinates()) on[static_cast<std::size_t>(i)].push_back(c.get());
  // The constraints of its own (Euler parameters' norm, a rigid frame) bind a body in space to nothing; a joint to
  // the ground does.
  const auto free = [&](const std::string& kind, const std::string& name, const std::vector<int>& own) {
    for (const int i : own)
      for (const Constraint* c : on[static_cast<std::size_t>(i)])
        if (c->path() != kind + "." + name) return false;
    return true;
  };
  std::unordered_set<int> of_bodies;
  for (const auto& [kind, bodies] : {std::pair{"rigid_body", &rigid_bodies_}, {"natural_body", &natural_bodies_}})
    for (const auto& [name, own] : *bodies)
      if (free(kind, name, own)) {
        give(name);
        of_bodies.insert(own.begin(), own.end());
      }
  for (int i = 0; i < m.coordinate_count(); ++i)
    if (on[static_cast<std::size_t>(i)].empty() && of_bodies.count(i) == 0)
      give(m.coordinates_[static_cast<std::size_t>(i)].name);
  for (GivenStart& g : m.given_positions_) g.name.clear();  // see given_by_itself
}

}  // namespace costate
