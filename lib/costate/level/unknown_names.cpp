#include "costate/level/unknown_names.h"

#include "costate/mechanism/multiplier_unit.h"

namespace costate {

void append_differential_unknowns(const Mechanism& m, std::vector<Unknown>& u) {
  for (const auto& c : m.coordinates()) u.push_back({c.name, c.unit, Unknown::Role::position, true, true});
  for (const auto& c : m.coordinates())
    u.push_back({c.name + "_dot", c.unit + "/s", Unknown::Role::velocity, true, true});
  for (const auto& f : m.forces())
    for (int i = 0; i < f->states(); ++i)
      u.push_back(
          {"z." + f->path() + "." + f->state_name(i), f->state_unit(i), Unknown::Role::force_state, true, true});
}

void append_algebraic_unknowns(const Mechanism& m, std::vector<Unknown>& u, bool in_norm) {
  for (const auto& c : m.coordinates())
    u.push_back({c.name + "_ddot", c.unit + "/s^2", Unknown::Role::acceleration, false, in_norm});
  const auto rows = m.row_names(), units = multiplier_units(m);
  for (std::size_t i = 0; i < rows.size(); ++i)
    u.push_back({"lambda." + rows[i], units[i], Unknown::Role::multiplier, false, in_norm});
}

}  // namespace costate
