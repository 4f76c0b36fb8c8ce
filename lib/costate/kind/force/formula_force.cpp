#include "costate/kind/force/formula_force.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/element/force/formula_force.h"
#include "costate/element/force/with_work.h"
#include "costate/kind/lookup.h"

namespace costate {

namespace {

FormulaInput find_input(const MechanismBuilder& builder, const std::string& subject, const std::string& name) {
  FormulaInput input;
  std::string of = name;
  if (of.ends_with("_dot")) {
    input.rate = true;
    of.resize(of.size() - 4);
  }
  try {
    input.of = builder.coordinate(of);
    return input;
  } catch (const ModelError&) {  // no coordinate
  }
  const std::size_t dot = of.find_last_of('.');
  if (dot != std::string::npos && dot + 2 == of.size() && of.back() >= 'x' && of.back() <= 'z') try {
      input.component = of.back() - 'x';
      const std::string point = of.substr(0, dot);
      if (builder.has_spatial_point(point)) {
        input.of = builder.spatial_point(point);
        return input;
      }
      if (input.component < 2) {
        input.of = builder.point(point);
        return input;
      }
    } catch (const ModelError&) {  // no point
    }
  throw ModelError(subject,
                   fmt::format("'{}' is no position or velocity. The formula of a force can hold t, numbers beside it, "
                               "coordinates and points (crank.angle, P.x) and their rates (P.x_dot).",
                               name));
}

/// `keys` of the formulas in the scene, for errors.
void add_action(MechanismBuilder& builder, const std::string& kind, const std::string& name, FormulaTarget target,
                const std::vector<std::string>& formulas, const std::vector<std::string>& keys,
                const FormulaNumbers& numbers, bool with_work, const std::vector<int>& lag = {}) {
  const std::string path = kind + "." + name;
  std::vector<std::string> names;
  for (const auto& [key, value] : numbers) names.push_back(key);
  std::vector<bool> used(names.size(), false);
  std::vector<FormulaForce::Component> components;
  for (std::size_t c = 0; c < formulas.size(); ++c) {
    FormulaForce::Component& component = components.emplace_back();
    if (formulas[c].empty()) continue;
    const std::string subject = path + "." + keys[c];
    std::vector<std::string> others;
    try {
      component.formula = std::make_shared<FormulaLaw>(formulas[c], names, others);
    } catch (const ModelError& e) {
      throw ModelError(subject, e.bare_message());
    }
    if (names.size() + others.size() > FormulaForce::kMostNames)
      throw ModelError(subject, fmt::format("holds {} names, of {} at most.", names.size() + others.size(),
                                            FormulaForce::kMostNames));
    for (const std::string& other : others) component.inputs.push_back(find_input(builder, subject, other));
    for (std::size_t k = 0; k < names.size(); ++k) used[k] = used[k] || component.formula->uses(k);
  }
  for (std::size_t k = 0; k < names.size(); ++k)
    if (!used[k]) throw ModelError(path + "." + names[k], fmt::format("'{}' is in no formula here.", names[k]));
  std::vector<int> indices;
  for (const auto& [key, value] : numbers) indices.push_back(builder.add_number(path + "." + key, value));
  builder.add(make_force<FormulaForce>(with_work, kind, name, std::move(target), std::move(components), indices, lag));
}

}  // namespace

FormulaNumbers read_formula_numbers(SceneTable& table, const std::vector<std::string>& others) {
  FormulaNumbers numbers;
  for (const std::string& key : table.keys())
    if (std::find(others.begin(), others.end(), key) == others.end()) numbers.emplace_back(key, table.value(key));
  return numbers;
}

void add_formula_actuator(MechanismBuilder& builder, const std::string& name, const std::string& from,
                          const std::string& to, const ActuatorOptions& o, const std::string& command_N,
                          const FormulaNumbers& numbers) {
  const std::string path = "actuator." + name;
  const auto lag = add_lag_numbers(builder, path, o.time_constant_s, "initial_force_N", o.initial_force_N);
  const auto add = [&](FormulaTarget line) {
    add_action(builder, "actuator", name, std::move(line), {command_N}, {"formula"}, numbers, o.work, lag);
  };
  if (is_spatial(builder, from, to))
    add(find_spatial_line(builder, path, from, to));
  else
    add(find_line(builder, path, from, to));
}

void add_formula_rotary_actuator(MechanismBuilder& builder, const std::string& name,
                                 const std::vector<std::string>& angles, const RotaryActuatorOptions& o,
                                 const std::string& command_N_m, const FormulaNumbers& numbers) {
  const std::string path = "actuator." + name;
  const auto lag = add_lag_numbers(builder, path, o.time_constant_s, "initial_torque_N_m", o.initial_torque_N_m);
  add_action(builder, "actuator", name, find_angles(builder, path, angles), {command_N_m}, {"formula"}, numbers, o.work,
             lag);
}

void add_formula_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                        const std::string& torque_N_m, const FormulaNumbers& numbers, bool with_work) {
  add_action(builder, "couple", name, find_angles(builder, "couple." + name, angles), {torque_N_m}, {"formula"},
             numbers, with_work);
}

void add_formula_force(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const std::vector<std::string>& components_N, const FormulaNumbers& numbers, bool with_work) {
  const std::vector<std::string> keys = {"formula_x_N", "formula_y_N", "formula_z_N"};
  const std::string path = "force." + name;
  const auto ground = [&](bool is) {
    if (is) throw ModelError(path + ".point", "'" + point + "' is on the ground, where a force does nothing.");
  };
  if (builder.has_spatial_point(point)) {
    const SpatialPoint& p = builder.spatial_point(point);
    ground(p.kind() == SpatialPoint::Kind::ground);
    return add_action(builder, "force", name, p, components_N, keys, numbers, with_work);
  }
  const PlanarPoint& p = find_point(builder, path + ".point", point);
  ground(p.kind() == PlanarPoint::Kind::ground);
  if (components_N.size() > 2 && !components_N[2].empty())
    throw ModelError(path + ".formula_z_N", "'" + point + "' is a point of the plane and has no z.");
  add_action(builder, "force", name, p, {components_N[0], components_N[1]}, keys, numbers, with_work);
}

}  // namespace costate
