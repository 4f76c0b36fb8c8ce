#include "costate/kind/force/force.h"

#include "costate/base/error.h"
#include "costate/element/force/point_force.h"
#include "costate/element/force/with_work.h"
#include "costate/kind/force/formula_force.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/law/table_options.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_force(MechanismBuilder& builder, const std::string& name, const std::string& point, const LawOptions& x_N,
               const LawOptions& y_N, bool with_work) {
  const std::string path = "force." + name;
  const PlanarPoint& p = find_point(builder, path + ".point", point);
  if (p.kind() == PlanarPoint::Kind::ground)
    throw ModelError(path + ".point", "'" + point + "' is on the ground, where a force does nothing.");
  const RegisteredLaw x = add_law(builder, path + ".x_N", x_N), y = add_law(builder, path + ".y_N", y_N);
  std::vector<int> numbers = x.numbers;
  numbers.insert(numbers.end(), y.numbers.begin(), y.numbers.end());
  builder.add(make_force<PointForce>(with_work, name, p, x.law, y.law, numbers));
}

void add_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                const LawOptions& torque_N_m, bool with_work) {
  const std::string path = "couple." + name;
  const std::vector<int> coordinates = find_angles(builder, path, angles);
  const RegisteredLaw torque = add_law(builder, path + ".torque_N_m", torque_N_m);
  builder.add(make_force<Couple>(with_work, name, coordinates, torque.law, torque.numbers));
}

namespace {
struct RegisteredVector {
  VectorLaw law;
  std::vector<int> numbers;
};
RegisteredVector add_vector(MechanismBuilder& builder, const std::string& path, const std::string& unit,
                            const std::array<LawOptions, 3>& components) {
  RegisteredVector r;
  for (std::size_t k = 0; k < 3; ++k) {
    const RegisteredLaw law = add_law(builder, path + "." + "xyz"[k] + "_" + unit, components[k]);
    r.law.component[k] = law.law;
    r.numbers.insert(r.numbers.end(), law.numbers.begin(), law.numbers.end());
  }
  return r;
}
}  // namespace

void add_spatial_force(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const std::array<LawOptions, 3>& force_N, ForceFrame frame, bool with_work) {
  const std::string path = "force." + name;
  const SpatialPoint& p = builder.spatial_point(point);
  if (p.kind() == SpatialPoint::Kind::ground)
    throw ModelError(path + ".point", "'" + point + "' is on the ground, where a force does nothing.");
  if (frame == ForceFrame::body && p.rotation_coordinates().empty())
    throw ModelError(path + ".frame", "'" + point + "' is not on a rigid body that the force could turn with.");
  const RegisteredVector v = add_vector(builder, path, "N", force_N);
  builder.add(make_force<SpatialPointForce>(with_work, name, p, v.law, v.numbers, frame));
}

void add_spatial_couple(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& bodies,
                        const std::array<LawOptions, 3>& torque_N_m, ForceFrame frame, bool with_work) {
  const std::string path = "couple." + name;
  if (bodies.empty() || bodies.size() > 2)
    throw ModelError(path + ".bodies", "One body or two are needed, found " + std::to_string(bodies.size()) + ".");
  if (bodies.size() == 2 && bodies[0] == bodies[1])
    throw ModelError(path + ".bodies[1]", "The two bodies must differ, both are '" + bodies[0] + "'.");
  std::vector<int> rotations;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto& q = find_rigid_body(
        builder, path + (bodies.size() == 1 ? ".body" : ".bodies[" + std::to_string(i) + "]"), bodies[i]);
    rotations.insert(rotations.end(), q.begin() + 3, q.end());
  }
  const RegisteredVector v = add_vector(builder, path, "N_m", torque_N_m);
  builder.add(make_force<SpatialCouple>(with_work, name, rotations, v.law, v.numbers, frame));
}

namespace {

/// x_UNIT, y_UNIT, z_UNIT, of which one at least.
std::array<LawOptions, 3> read_vector(SceneTable& table, const std::string& unit) {
  const std::string x = "x_" + unit, y = "y_" + unit, z = "z_" + unit;
  if (!table.has(x) && !table.has(y) && !table.has(z))
    table.fail("needs '" + x + "', '" + y + "' or '" + z + "' (a number or a law of time).");
  return {read_law(table, x, 0), read_law(table, y, 0), read_law(table, z, 0)};
}
ForceFrame read_frame(SceneTable& table) {
  return table.one_of("frame", {"ground", "body"}, "ground") == "body" ? ForceFrame::body : ForceFrame::ground;
}

const RegisterSceneKind force({
    .name = "force",
    .phase = ScenePhase::elements,
    .summary = "a force on a point: constant, a law of time, or a formula of positions and velocities",
    .example = R"(
[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[bar.arm]
from = "A"
to = "P"
mass_kg = 2

[point.middle]
on = "arm"
x_m = 0.5
y_m = 0.1

[body.plate]
x_m = 1.5
y_m = -0.2
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.4

[point.ear]
on = "plate"
x_m = -0.3
y_m = 0.2

[force.push]
point = "P"
x_N = 3

[force.pull]
point = "middle"
work = true
x_N = 1
y_N = { kind = "table", x = [0, 0.5, 1, 2], y = [0, 2, 1, 4] }

[force.wind]
point = "middle"
formula_x_N = "-c*(P.x_dot - w)*sqrt((P.x_dot - w)^2 + 0.1) + k*ear.y"
formula_y_N = "sin(2*t)*plate.angle_dot"
c = 0.4
w = 2
k = 0.7
work = true

[force.lash]
point = "corner"
formula_z_N = "-g*corner.z_dot + stone.e1*corner.x"
g = 0.3

[force.shake]
point = "ear"
x_N = { kind = "sine", mean = 0, amplitude = 4, angular_frequency_rad_per_s = 6 }
y_N = { kind = "polynomial", coefficients = [1, 2] }

[rigid_body.stone]
x_m = 0.2
y_m = 1.0
z_m = -0.5
rotation_axis = [1, 2, -1]
angle_rad = 0.4
mass_kg = 3.0
inertia_xx_kg_m2 = 0.7
inertia_yy_kg_m2 = 0.9
inertia_zz_kg_m2 = 0.5

[point.corner]
on = "stone"
x_m = 0.3
y_m = -0.1
z_m = 0.2

[force.thrust]
point = "corner"
frame = "body"
x_N = 2
z_N = { kind = "sine", mean = 1, amplitude = 4, angular_frequency_rad_per_s = 6 }

[force.lift]
point = "corner"
work = true
y_N = 0.5
z_N = 3

[start]
given = ["P.x", "plate.x", "plate.y", "plate.angle", "stone"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string point = table.text("point");
          const bool work = table.flag("work", false);
          if (table.has("formula_x_N") || table.has("formula_y_N") || table.has("formula_z_N")) {
            std::vector<std::string> formulas;
            for (const char* key : {"formula_x_N", "formula_y_N", "formula_z_N"})
              formulas.push_back(table.text(key, ""));
            return add_formula_force(
                builder, name, point, formulas,
                read_formula_keys(table, {"point", "formula_x_N", "formula_y_N", "formula_z_N", "work"}), work);
          }
          if (builder.has_spatial_point(point)) {
            const auto f = read_vector(table, "N");
            return add_spatial_force(builder, name, point, f, read_frame(table), work);
          }
          if (!table.has("x_N") && !table.has("y_N")) table.fail("needs 'x_N' or 'y_N' (a number or a law of time).");
          const LawOptions x = read_law(table, "x_N", 0), y = read_law(table, "y_N", 0);
          add_force(builder, name, point, x, y, work);
        },
});

const RegisterSceneKind couple({
    .name = "couple",
    .phase = ScenePhase::elements,
    .summary = "a torque on an angle or a rigid body, or between two: constant, a law of time, or a formula",
    .example = R"(
[body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.1
mass_kg = 1
inertia_kg_m2 = 0.1

[body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1

[couple.drive]
angle = "wheel"
work = true
torque_N_m = 0.3

[couple.gas]
angle = "wheel"
formula = "p*(1 + a*cos(wheel.angle))^(-1.4)*valve(wheel.angle) - d*wheel.angle_dot"
valve = { kind = "data", x = [-3, -1.2, 0.2, 1.5, 3.3], y = [0.4, -0.6, 0.1, 0.8, 0.4], beyond = "repeat" }
p = 0.8
a = 0.5
d = 0.02
work = true

[couple.governor]
angles = ["wheel", "disc"]
formula = "k*(w - disc.angle_dot) + wheel.x^2"
k = 0.2
w = 3

[couple.between]
angles = ["wheel", "disc"]
torque_N_m = { kind = "sine", mean = 0.1, amplitude = 1, angular_frequency_rad_per_s = 3, phase_rad = 0.4 }

[rigid_body.stone]
x_m = 0.2
y_m = 1.0
z_m = -0.5
rotation_axis = [1, 2, -1]
angle_rad = 0.4
mass_kg = 3.0
inertia_xx_kg_m2 = 0.7
inertia_yy_kg_m2 = 0.9
inertia_zz_kg_m2 = 0.5

[rigid_body.pebble]
x_m = 0.9
y_m = 1.0
z_m = -0.5
rotation_axis = [0, 1, 1]
angle_rad = 0.4
mass_kg = 3.0
inertia_xx_kg_m2 = 0.7
inertia_yy_kg_m2 = 0.9
inertia_zz_kg_m2 = 0.5

[couple.spin]
body = "stone"
frame = "body"
z_N_m = 0.6

[couple.turn]
body = "pebble"
x_N_m = { kind = "polynomial", coefficients = [1, 2] }

[couple.gear]
work = true
bodies = ["stone", "pebble"]
frame = "body"
x_N_m = 0.2
y_N_m = -0.4

[start]
given = ["wheel.x", "wheel.y", "wheel.angle", "disc.x", "disc.y", "disc.angle", "stone", "pebble"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const bool work = table.flag("work", false);
          if (table.has("body") || table.has("bodies")) {
            std::vector<std::string> bodies = table.texts("bodies", false);
            if (bodies.empty()) bodies = {table.text("body")};
            const auto torque = read_vector(table, "N_m");
            return add_spatial_couple(builder, name, bodies, torque, read_frame(table), work);
          }
          const auto angles = read_angles(table);
          if (table.has("formula")) {
            const std::string formula = table.text("formula");
            return add_formula_couple(builder, name, angles, formula,
                                      read_formula_keys(table, {"angle", "angles", "formula", "work"}), work);
          }
          add_couple(builder, name, angles, read_law(table, "torque_N_m"), work);
        },
});

}  // namespace

}  // namespace costate
