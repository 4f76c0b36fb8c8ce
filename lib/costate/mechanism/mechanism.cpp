#include "costate/mechanism/mechanism.h"

#include <fmt/format.h>

#include "costate/base/error.h"

namespace costate {

namespace {
std::vector<std::string> keys(const std::map<std::string, int>& m) {
  std::vector<std::string> r;
  for (const auto& [k, v] : m) r.push_back(k);
  return r;
}
}  // namespace

std::vector<double> Mechanism::base_numbers() const {
  std::vector<double> r;
  r.reserve(numbers_.size());
  for (const auto& n : numbers_) r.push_back(n.value);
  return r;
}

int Mechanism::coordinate(const std::string& name) const {
  const auto at = coordinate_index_.find(name);
  if (at == coordinate_index_.end())
    throw ModelError("", fmt::format("There is no coordinate '{}'.{}", name, suggestion(name, keys(coordinate_index_))));
  return at->second;
}

int Mechanism::number(const std::string& path) const {
  const auto at = number_index_.find(path);
  if (at == number_index_.end())
    throw ModelError("", fmt::format("There is no number '{}'.{}", path, suggestion(path, keys(number_index_))));
  return at->second;
}

const PlanarPoint& Mechanism::point(const std::string& name) const {
  const auto at = point_index_.find(name);
  if (spatial_point_index_.count(name))
    throw ModelError("", fmt::format("Point '{}' is a point of space (it has z_m); a planar point is needed here.",
                                     name));
  if (at == point_index_.end())
    throw ModelError("", fmt::format("There is no point '{}'.{}", name, suggestion(name, keys(point_index_))));
  return points_[at->second];
}

const SpatialPoint& Mechanism::spatial_point(const std::string& name) const {
  const auto at = spatial_point_index_.find(name);
  if (point_index_.count(name))
    throw ModelError("", fmt::format("Point '{}' is a planar point; a point of space is needed here. Give it a z_m.",
                                     name));
  if (at == spatial_point_index_.end())
    throw ModelError("", fmt::format("There is no spatial point '{}'.{}", name,
                                     suggestion(name, keys(spatial_point_index_))));
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
  for (const auto& name : wanted) {
    for (const auto& p : selection.parameters)
      if (p.name == name) throw ModelError("", fmt::format("Parameter '{}' is listed twice.", name));
    Parameter chosen;
    bool found = false;
    for (const auto& p : parameters_)
      if (p.name == name) {
        chosen = p;
        found = true;
      }
    if (!found) {
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
        throw ModelError("parameter." + name, fmt::format("'{}' cannot vary: {}", numbers_[number].path,
                                                          numbers_[number].fixed_because));
      for (const auto& other : selection.parameters)
        for (const auto& [taken, f] : other.bindings)
          if (taken == number)
            throw ModelError("parameter." + name, fmt::format("'{}' is already varied by parameter '{}'.",
                                                              numbers_[number].path, other.name));
    }
    selection.parameters.push_back(std::move(chosen));
  }
  return selection;
}

}  // namespace costate
