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

/// `at`: keys of the formulas in the scene, for errors.
void add_action(MechanismBuilder& builder, const std::string& kind, const std::string& name, FormulaTarget target,
                const std::vector<std::string>& formulas, const std::vector<std::string>& at, const FormulaKeys& keys,
                bool with_work, const std::vector<int>& lag = {}) {
  const std::string path = kind + "." + name;
  FormulaReader reader(path, keys);
  std::vector<FormulaForce::Component> components;
  for (std::size_t c = 0; c < formulas.size(); ++c) {
    FormulaForce::Component& component = components.emplace_back();
    if (formulas[c].empty()) continue;
    std::vector<std::string> others;
    component.formula = reader.read(formulas[c], at[c], others, FormulaForce::kMostNames);
    for (const std::string& other : others) component.inputs.push_back(find_input(builder, path + "." + at[c], other));
  }
  reader.require_used();
  const std::vector<int> indices = reader.add_numbers(builder);
  builder.add(make_force<FormulaForce>(with_work, kind, name, std::move(target), std::move(components), indices, lag));
}

}  // namespace

void add_formula_actuator(MechanismBuilder& builder, const std::string& name, const std::string& from,
                          const std::string& to, const ActuatorOptions& o, const std::string& command_N,
                          const FormulaKeys& keys) {
  const std::string path = "actuator." + name;
  const auto lag = add_lag_numbers(builder, path, o.time_constant_s, "initial_force_N", o.initial_force_N);
  const auto add = [&](FormulaTarget line) {
    add_action(builder, "actuator", name, std::move(line), {command_N}, {"formula"}, keys, o.work, lag);
  };
  if (is_spatial(builder, from, to))
    add(find_spatial_line(builder, path, from, to));
  else
    add(find_line(builder, path, from, to));
}

void add_formula_rotary_actuator(MechanismBuilder& builder, const std::string& name,
                                 const std::vector<std::string>& angles, const RotaryActuatorOptions& o,
                                 const std::string& command_N_m, const FormulaKeys& keys) {
  const std::string path = "actuator." + name;
  const auto lag = add_lag_numbers(builder, path, o.time_constant_s, "initial_torque_N_m", o.initial_torque_N_m);
  add_action(builder, "actuator", name, find_angles(builder, path, angles), {command_N_m}, {"formula"}, keys, o.work,
             lag);
}

void add_formula_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                        const std::string& torque_N_m, const FormulaKeys& keys, bool with_work) {
  add_action(builder, "couple", name, find_angles(builder, "couple." + name, angles), {torque_N_m}, {"formula"}, keys,
             with_work);
}

void add_formula_force(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const std::vector<std::string>& components_N, const FormulaKeys& keys, bool with_work) {
  const std::vector<std::string> at = {"formula_x_N", "formula_y_N", "formula_z_N"};
  const std::string path = "force." + name;
  const auto ground = [&](bool is) {
    if (is) throw ModelError(path + ".point", "'" + point + "' is on the ground, where a force does nothing.");
  };
  if (builder.has_spatial_point(point)) {
    const SpatialPoint& p = builder.spatial_point(point);
    ground(p.kind() == SpatialPoint::Kind::ground);
    return add_action(builder, "force", name, p, components_N, at, keys, with_work);
  }
  const PlanarPoint& p = find_point(builder, path + ".point", point);
  ground(p.kind() == PlanarPoint::Kind::ground);
  if (components_N.size() > 2 && !components_N[2].empty())
    throw ModelError(path + ".formula_z_N", "'" + point + "' is a point of the plane and has no z.");
  add_action(builder, "force", name, p, {components_N[0], components_N[1]}, at, keys, with_work);
}

}  // namespace costate
