#include "costate/kind/force/spring.h"

#include "costate/element/force/angular_force.h"
#include "costate/kind/force/axial_line.h"
#include "costate/kind/force/central_spring.h"
#include "costate/kind/law/law_table.h"
#include "costate/kind/law/measured_columns.h"
#include "costate/kind/law/table_options.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
SpringDamperLaw with_laws(MechanismBuilder& builder, const std::string& path, const LawOptions& spring,
                          const LawOptions& damper, std::vector<int>& numbers, bool turns) {
  SpringDamperLaw law;
  const auto add = [&](const char* key, const LawOptions& options, std::shared_ptr<const ScalarLaw>& to,
                       const char* of) {
    if (!options) return;
    require_units(path + "." + key, options, turns ? "N m" : "N", of);
    const RegisteredLaw r = add_law(builder, path + "." + key, options);
    to = r.law;
    numbers.insert(numbers.end(), r.numbers.begin(), r.numbers.end());
  };
  add("spring_law", spring, law.spring, turns ? "rad" : "m");
  add("damper_law", damper, law.damper, turns ? "rad/s" : "m/s");
  return law;
}
}  // namespace

SpringParts add_spring_parts(MechanismBuilder& builder, const std::string& path, const SpringOptions& o,
                             NumberRule length) {
  constexpr auto rule = NumberRule::non_negative;
  SpringParts r;
  r.numbers = {builder.add_number(path + ".stiffness_N_per_m", o.stiffness_N_per_m, rule),
               builder.add_number(path + ".natural_length_m", o.natural_length_m, length),
               builder.add_number(path + ".damping_N_s_per_m", o.damping_N_s_per_m, rule),
               builder.add_number(path + ".preload_N", o.preload_N)};
  r.law = with_laws(builder, path, o.spring_law, o.damper_law, r.numbers, false);
  return r;
}

void add_spring(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                const SpringOptions& o) {
  const std::string path = "spring." + name;
  const SpringParts parts = add_spring_parts(builder, path, o);
  if (o.stiffness_N_per_m != 0 && o.natural_length_m == 0 && o.damping_N_s_per_m == 0 && o.preload_N == 0 &&
      !o.spring_law && !o.damper_law) {
    using Planar = LineWithEnds<PlanarVector>;
    using Spatial = LineWithEnds<SpatialVector>;
    if (is_spatial(builder, from, to))
      builder.add(std::make_unique<AxialForce<CentralSpringLaw, Spatial>>(
          "spring", name, CentralSpringLaw{path}, parts.numbers, Spatial(find_spatial_line(builder, path, from, to))));
    else
      builder.add(std::make_unique<AxialForce<CentralSpringLaw, Planar>>(
          "spring", name, CentralSpringLaw{path}, parts.numbers, Planar(find_line(builder, path, from, to))));
    return;
  }
  add_axial_force(builder, "spring", name, parts.law, parts.numbers, from, to);
}

void add_torsion_spring(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                        const TorsionSpringOptions& o) {
  const std::string path = "torsion_spring." + name;
  const std::vector<int> coordinates = find_angles(builder, path, angles);
  constexpr auto rule = NumberRule::non_negative;
  std::vector<int> numbers = {builder.add_number(path + ".stiffness_N_m_per_rad", o.stiffness_N_m_per_rad, rule),
                              builder.add_number(path + ".natural_angle_rad", o.natural_angle_rad),
                              builder.add_number(path + ".damping_N_m_s_per_rad", o.damping_N_m_s_per_rad, rule),
                              builder.add_number(path + ".preload_N_m", o.preload_N_m)};
  const SpringDamperLaw law = with_laws(builder, path, o.spring_law, o.damper_law, numbers, true);
  builder.add(std::make_unique<AngularForce<SpringDamperLaw>>("torsion_spring", name, law, numbers, coordinates));
}

SpringOptions read_spring_options(SceneTable& table) {
  SpringOptions o;
  o.stiffness_N_per_m = table.value("stiffness_N_per_m", NumberRule::non_negative, 0);
  o.spring_law = find_law(table, "spring_law");
  // A pure damper needs no natural length: asked for whether it is there, the key is none that every spring needs.
  table.has("natural_length_m");
  const bool elastic = o.stiffness_N_per_m != 0 || o.spring_law;
  o.natural_length_m = elastic ? table.value("natural_length_m") : table.value("natural_length_m", {}, 0);
  o.damping_N_s_per_m = table.value("damping_N_s_per_m", NumberRule::non_negative, 0);
  o.preload_N = table.value("preload_N", NumberRule::any, 0);
  o.damper_law = find_law(table, "damper_law");
  return o;
}

namespace {

void add_spring_table(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  const std::string from = table.text("from"), to = table.text("to");
  add_spring(builder, name, from, to, read_spring_options(table));
}

void add_torsion_spring_table(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  const auto angles = read_angles(table);
  TorsionSpringOptions o;
  o.stiffness_N_m_per_rad = table.value("stiffness_N_m_per_rad", NumberRule::non_negative, 0);
  o.natural_angle_rad = table.value("natural_angle_rad", NumberRule::any, 0);
  o.damping_N_m_s_per_rad = table.value("damping_N_m_s_per_rad", NumberRule::non_negative, 0);
  o.preload_N_m = table.value("preload_N_m", NumberRule::any, 0);
  o.spring_law = find_law(table, "spring_law");
  o.damper_law = find_law(table, "damper_law");
  add_torsion_spring(builder, name, angles, o);
}

const RegisterSceneKind spring({
    .name = "spring",
    .phase = ScenePhase::elements,
    .summary = "a spring and damper between two points, linear or by laws",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[mass.bob]
point = "P"
mass_kg = 1.5

[body.plate]
x_m = 1.5
y_m = -0.2
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.4
center_x_m = 0.1

[point.ear]
on = "plate"
x_m = -0.3
y_m = 0.2

[spring.linear]
from = "A"
to = "P"
stiffness_N_per_m = 120
natural_length_m = 0.9
damping_N_s_per_m = 3
preload_N = 2

[spring.hardening]
from = "P"
to = "ear"
natural_length_m = 0.5
spring_law = { kind = "polynomial", coefficients = [0, 80, 0, 400] }
damper_law = { kind = "table", x = [-1, 0, 1, 2], y = [-3, 0, 5, 8] }

[spring.tie]
from = "A"
to = "ear"
stiffness_N_per_m = 60
natural_length_m = 0.7

[start]
given = ["P.x", "P.y", "plate.x", "plate.y", "plate.angle"]
)",
    .add = add_spring_table,
});

const RegisterSceneKind torsion_spring({
    .name = "torsion_spring",
    .phase = ScenePhase::elements,
    .summary = "a torsion spring and damper on an angle, or between two angles",
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

[angle.crank]
bar = "arm"

[body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1

[torsion_spring.hinge]
angle = "crank"
stiffness_N_m_per_rad = 20
natural_angle_rad = -0.5
damping_N_m_s_per_rad = 0.4
preload_N_m = 0.1

[torsion_spring.coupling]
angles = ["crank", "disc"]
stiffness_N_m_per_rad = 5
spring_law = { kind = "polynomial", coefficients = [0, 0, 0, 3] }
damper_law = { kind = "table", x = [-1, 0, 1], y = [-0.2, 0, 0.3] }

[start]
given = ["crank.angle", "disc.x", "disc.y", "disc.angle"]
)",
    .add = add_torsion_spring_table,
});

}  // namespace

}  // namespace costate
