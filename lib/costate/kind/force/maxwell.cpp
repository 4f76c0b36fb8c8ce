#include "costate/kind/force/maxwell.h"

#include "costate/kind/force/axial_line.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_maxwell(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                 const MaxwellOptions& o) {
  const std::string path = "maxwell." + name;
  const std::vector<int> numbers = {
      builder.add_number(path + ".stiffness_N_per_m", o.stiffness_N_per_m, NumberRule::positive),
      builder.add_number(path + ".natural_length_m", o.natural_length_m, NumberRule::non_negative),
      builder.add_number(path + ".damping_N_s_per_m", o.damping_N_s_per_m, NumberRule::positive),
      builder.add_number(path + ".initial_stroke_m", o.initial_stroke_m)};
  add_axial_force(builder, "maxwell", name, MaxwellLaw(), numbers, from, to);
}

namespace {

const RegisterSceneKind maxwell_registered({
    .name = "maxwell",
    .phase = ScenePhase::elements,
    .summary = "a spring in series with a damper between two points",
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

[spring.S]
from = "A"
to = "P"
stiffness_N_per_m = 120
natural_length_m = 0.9

[maxwell.relaxation]
from = "A"
to = "P"
stiffness_N_per_m = 300
natural_length_m = 0.9
damping_N_s_per_m = 40
initial_stroke_m = 0.01

[start]
given = ["P.x", "P.y"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string from = table.text("from"), to = table.text("to");
          MaxwellOptions o;
          o.stiffness_N_per_m = table.value("stiffness_N_per_m");
          o.natural_length_m = table.value("natural_length_m");
          o.damping_N_s_per_m = table.value("damping_N_s_per_m");
          o.initial_stroke_m = table.value("initial_stroke_m", NumberRule::any, 0);
          add_maxwell(builder, name, from, to, o);
        },
});

}  // namespace

}  // namespace costate
