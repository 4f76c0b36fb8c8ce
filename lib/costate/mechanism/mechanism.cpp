#include "costate/mechanism/mechanism.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <unordered_map>
#include <unordered_set>

#include "costate/base/error.h"

namespace costate {

namespace {
std::vector<std::string> keys(const std::map<std::string, int>& m) {
  std::vector<std::string> r;
  for (const auto& [k, v] : m) r.push_back(k);
  return r;
}
std::vector<std::string> keys_below(const std::map<std::string, int>& m, const std::string& prefix) {
  std::vector<std::string> r;
  for (auto at = m.lower_bound(prefix); at != m.end() && at->first.starts_with(prefix); ++at) r.push_back(at->first);
  return r;
}
}  // namespace

std::vector<double> Mechanism::first_positions() const {
  std::vector<double> q;
  for (const Coordinate& c : coordinates_) q.push_back(numbers_[static_cast<std::size_t>(c.position_number)].value);
  return q;
}

std::vector<double> Mechanism::base_numbers() const {
  std::vector<double> r;
  r.reserve(numbers_.size());
  for (const auto& n : numbers_) r.push_back(n.value);
  return r;
}

int Mechanism::coordinate(const std::string& name) const {
  const auto at = coordinate_index_.find(name);
  if (at != coordinate_index_.end()) return at->second;
  // An element with one coordinate, an angle, say, may stand for it.
  const std::vector<std::string> own = keys_below(coordinate_index_, name + ".");
  if (own.size() == 1) return coordinate_index_.at(own.front());
  if (own.size() > 1)
    throw ModelError("",
                     fmt::format("'{}' has several coordinates, name one of them: {}.", name, fmt::join(own, ", ")));
  throw ModelError("", fmt::format("There is no coordinate '{}'.{}", name, suggestion(name, keys(coordinate_index_))));
}

int Mechanism::number(const std::string& path) const {
  const auto at = number_index_.find(path);
  if (at != number_index_.end()) return at->second;
  // Some keys make several numbers, as an angle about an axis makes Euler parameters: what its element has is said,
  // unless it is a table.
  constexpr std::size_t kFew = 30;
  const std::string element = path.substr(0, path.rfind('.') + 1);
  std::vector<std::string> own = keys_below(number_index_, element);
  for (std::string& name : own) name.erase(0, element.size());
  std::string has;
  if (!element.empty() && !own.empty() && own.size() <= kFew)
    has = fmt::format(" [{}] has these: {}.", element.substr(0, element.size() - 1), fmt::join(own, ", "));
  throw ModelError("", fmt::format("There is no number '{}'.{}{}", path, suggestion(path, keys(number_index_)), has));
}

const PlanarPoint& Mechanism::point(const std::string& name) const {
  const auto at = point_index_.find(name);
  if (spatial_point_index_.count(name))
    throw ModelError("",
                     fmt::format("Point '{}' is a point of space (it has z_m); a planar point is needed here.", name));
  if (at == point_index_.end())
    throw ModelError("", fmt::format("There is no point '{}'.{}", name, suggestion(name, keys(point_index_))));
  return points_[at->second];
}

const SpatialPoint& Mechanism::spatial_point(const std::string& name) const {
  const auto at = spatial_point_index_.find(name);
  if (point_index_.count(name))
    throw ModelError(
        "", fmt::format("Point '{}' is a planar point; a point of space is needed here. Give it a z_m.", name));
  if (at == spatial_point_index_.end())
    throw ModelError(
        "", fmt::format("There is no spatial point '{}'.{}", name, suggestion(name, keys(spatial_point_index_))));
  return spatial_points_[at->second];
}

const Element* Mechanism::find_element(const std::string& name) const {
  const auto search = [&](const auto& list) -> const Element* {
    for (const auto& e : list)
      if (e->name() == name || e->path() == name) return e.get();
    return nullptr;
  };
  if (const Element* e = search(forces_)) return e;
  if (const Element* e = search(constraints_)) return e;
  return search(bodies_);
}

std::vector<std::string> Mechanism::coordinate_names() const {
  std::vector<std::string> r;
  for (const auto& c : coordinates_) r.push_back(c.name);
  return r;
}

std::vector<std::string> Mechanism::row_names() const {
  std::vector<std::string> r;
  for (const auto& c : constraints_)
    for (int i = 0; i < c->rows(); ++i) r.push_back(c->path() + "." + c->row_name(i));
  return r;
}

std::vector<std::string> Mechanism::state_names() const {
  std::vector<std::string> r;
  for (const auto& f : forces_)
    for (int i = 0; i < f->states(); ++i) r.push_back(f->path() + "." + f->state_name(i));
  return r;
}

ParameterSelection Mechanism::select(const std::vector<std::string>& names) const {
  std::vector<std::string> wanted = names.empty() ? default_parameters_ : names;
  ParameterSelection selection;
  std::unordered_map<std::string, const Parameter*> by_name;
  if (wanted.size() > 1)
    for (const auto& p : parameters_) by_name.emplace(p.name, &p);
  const auto find = [&](const std::string& name) -> const Parameter* {
    if (wanted.size() > 1) {
      const auto at = by_name.find(name);
      return at == by_name.end() ? nullptr : at->second;
    }
    for (const auto& p : parameters_)
      if (p.name == name) return &p;
    return nullptr;
  };
  std::unordered_set<std::string> listed;
  std::unordered_map<int, std::size_t> varied_by;  // number -> place in the selection
  for (const auto& name : wanted) {
    if (!listed.insert(name).second) throw ModelError("", fmt::format("Parameter '{}' is listed twice.", name));
    Parameter chosen;
    if (const Parameter* found = find(name)) {
      chosen = *found;
    } else {
      const auto at = number_index_.find(name);
      if (at == number_index_.end()) {
        std::vector<std::string> known;
        for (const auto& p : parameters_) known.push_back(p.name);
        for (const auto& k : keys(number_index_)) known.push_back(k);
        throw ModelError("", fmt::format("There is no parameter '{}'.{}", name, suggestion(name, known)));
      }
      const Number& n = numbers_[at->second];
      chosen.name = name;
      chosen.bindings = {{at->second, 1.0}};
      chosen.value = n.value;
      chosen.scale = n.value != 0 ? std::abs(n.value) : 1.0;
    }
    for (const auto& [number, factor] : chosen.bindings) {
      if (!numbers_[number].fixed_because.empty())
        throw ModelError("parameter." + name,
                         fmt::format("'{}' cannot vary: {}", numbers_[number].path, numbers_[number].fixed_because));
      if (const auto taken = varied_by.find(number); taken != varied_by.end())
        throw ModelError("parameter." + name,
                         fmt::format("'{}' is already varied by parameter '{}'.", numbers_[number].path,
                                     selection.parameters[taken->second].name));
    }
    for (const auto& [number, factor] : chosen.bindings) varied_by.emplace(number, selection.parameters.size());
    selection.parameters.push_back(std::move(chosen));
  }
  return selection;
}

}  // namespace costate
