#include "costate/level/maggi_names.h"

#include "costate/level/unknown_names.h"

namespace costate {

void append_maggi_unknowns(const Mechanism& mechanism, int freedoms, std::vector<Unknown>& unknowns) {
  for (const auto role : {Unknown::Role::position, Unknown::Role::velocity})
    for (int i = 0; i < freedoms; ++i)
      unknowns.push_back(
          {"independent." + std::to_string(i) + (role == Unknown::Role::velocity ? "_dot" : ""), "", role, true, true});
  std::vector<Unknown> all;
  append_differential_unknowns(mechanism, all);
  for (const Unknown& u : all)
    if (u.role == Unknown::Role::force_state) unknowns.push_back(u);
  if (unknowns.empty()) unknowns.push_back({"idle", "1", Unknown::Role::force_state, true, true});
}

void name_maggi_unknowns(const Mechanism& mechanism, const std::vector<int>& independent,
                         const std::vector<int>& places, std::vector<Unknown>& unknowns) {
  const std::vector<std::string> rows = places.empty() ? std::vector<std::string>() : mechanism.row_names();
  std::size_t positions = 0, velocities = 0, accelerations = 0;
  const auto name = [&](Unknown& u, std::size_t k, const char* suffix, const char* unit) {
    if (k >= independent.size()) {
      u.name = "place." + rows[static_cast<std::size_t>(places[k - independent.size()])] + suffix;
      u.unit = std::string("m") + unit;
      return;
    }
    const Coordinate& c = mechanism.coordinates()[independent[k]];
    u.name = c.name + suffix;
    u.unit = c.unit + unit;
  };
  for (Unknown& u : unknowns) {
    if (u.role == Unknown::Role::position) name(u, positions++, "", "");
    if (u.role == Unknown::Role::velocity) name(u, velocities++, "_dot", "/s");
    if (u.role == Unknown::Role::acceleration) name(u, accelerations++, "_ddot", "/s^2");
  }
}

}  // namespace costate
