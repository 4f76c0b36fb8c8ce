// Scenes of what slides in space: a point, or a ball that spins, on rough ground or above it, as text whose words are
// replaced.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "support/with_words.h"

namespace costate::test {

using SceneWords = std::vector<std::pair<std::string, std::string>>;

/// The text with words of its own, and with `others` where it has none.
inline std::string with_own_words(const char* text, SceneWords own, const SceneWords& others) {
  for (const auto& other : others)
    if (std::none_of(own.begin(), own.end(), [&](const auto& word) { return word.first == other.first; }))
      own.push_back(other);
  return with_words(text, own);
}

/// A mass of 2 kg.
inline std::string sliding_point(const SceneWords& own) {
  return with_own_words(
      R"([gravity]
z_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
z_m = HEIGHT
vx_m_per_s = VX
vy_m_per_s = VY
[mass.P]
point = "P"
mass_kg = 2
[contact.floor]
kind = "rigid"
point = "P"
friction = "coulomb"
friction_coefficient = FRICTION
CONTACT
[start]
given = [GIVEN]
[run]
t_end_s = END
rtol = 1e-11
parameters = [PARAMETERS]
[parameter.g]
number = "gravity.z_m_per_s2"
factors = [-1]
[[cost.terminal]]
kind = "value"
output = "P.x"
[[cost.terminal]]
kind = "value"
output = "P.y"
weight = 2
MORE
)",
      own,
      {{"HEIGHT", "0"},
       {"VX", "1.2"},
       {"VY", "-0.9"},
       {"FRICTION", "0.3"},
       {"CONTACT", "closed = true\nsliding = \"forward\""},
       {"GIVEN", R"("P.x", "P.y")"},
       {"PARAMETERS", R"("contact.floor.friction_coefficient", "g", "point.P.vx_m_per_s", "point.P.vy_m_per_s")"},
       {"MORE", ""}});
}

/// A block on rough ground that another one, thrown past it, pulls by a spring: it sticks, slides and sticks.
inline std::string pulled_block(const SceneWords& own) {
  return with_own_words(R"(
[gravity]
UP_m_per_s2 = -9.81
[point.block]
x_m = 0
y_m = 0
Z_BLOCK
[mass.block]
point = "block"
mass_kg = 0.5
[point.puller]
PULLER
[mass.puller]
point = "puller"
mass_kg = 1.5
[spring.S]
from = "block"
to = "puller"
stiffness_N_per_m = 30
damping_N_s_per_m = 0.2
natural_length_m = 0.95
[point.nail]
ground = true
NAIL
[spring.hanger]
from = "nail"
to = "puller"
stiffness_N_per_m = 40
natural_length_m = 1.4
[contact.floor]
kind = "rigid"
point = "block"
closed = true
along_m = 0
friction = "coulomb"
friction_coefficient = 0.8
[start]
given = [GIVEN]
[run]
t_end_s = END
rtol = RTOL
formulation = "index1"
parameters = ["mass.block.mass_kg", "mass.puller.mass_kg", "spring.S.stiffness_N_per_m", "spring.S.natural_length_m", "spring.S.damping_N_s_per_m", "contact.floor.friction_coefficient"]
[[cost.running]]
kind = "square"
output = "block.ALONG"
target = 0.4
[[cost.running]]
kind = "square"
output = "floor.friction_force"
weight = 1e-3
[[cost.terminal]]
kind = "value"
output = "floor.normal_force"
weight = 1e-2
MORE
)",
                        own,
                        {{"UP", "z"},
                         {"Z_BLOCK", "z_m = 0"},
                         {"PULLER", "x_m = 0.9\ny_m = 0\nz_m = 0.3\nvx_m_per_s = 1.5\nvy_m_per_s = 0.7"},
                         {"NAIL", "x_m = 0.8\ny_m = 0\nz_m = 2"},
                         {"GIVEN", R"("puller.x", "puller.y", "puller.z")"},
                         {"ALONG", "x"},
                         {"END", "1.5"},
                         {"RTOL", "1e-11"},
                         {"MORE", ""}});
}

/// A solid one of 0.1 m and 1.5 kg, I = 2/5 m R^2 = 0.006.
inline std::string sliding_ball(const SceneWords& own) {
  return with_own_words(R"(
[gravity]
z_m_per_s2 = -9.81
[rigid_body.ball]
x_m = 0
y_m = 0
z_m = HEIGHT
e0 = 0.8
e1 = 0.2
e2 = -0.4
e3 = 0.4
mass_kg = 1.5
inertia_xx_kg_m2 = 0.006
inertia_yy_kg_m2 = YY
inertia_zz_kg_m2 = ZZ
vx_m_per_s = VX
vy_m_per_s = VY
vz_m_per_s = VZ
omega_global_x_rad_per_s = WX
omega_global_y_rad_per_s = WY
omega_global_z_rad_per_s = WZ
[point.C]
on = "ball"
x_m = OFF_X
y_m = 0
z_m = OFF_Z
[contact.floor]
kind = "rigid"
point = "C"
radius_m = 0.1
friction = "coulomb"
friction_coefficient = FRICTION
ground_angle_rad = ANGLE
STATE
[start]
GIVEN
[run]
t_end_s = END
rtol = 1e-11
formulation = "index1"
parameters = [PARAMETERS]
[[cost.terminal]]
kind = "value"
output = "ball.x"
[[cost.terminal]]
kind = "value"
output = "ball.y"
weight = 2
[[cost.terminal]]
kind = "value"
output = "ball.omega_global_z"
weight = 0.1
[[cost.terminal]]
kind = "value"
output = "ball.omega_x"
weight = 0.05
)",
                        own,
                        {{"HEIGHT", "0.1"},
                         {"YY", "0.006"},
                         {"ZZ", "0.006"},
                         {"VX", "1.2"},
                         {"VY", "-0.5"},
                         {"VZ", "0"},
                         {"WX", "3"},
                         {"WY", "-2"},
                         {"WZ", "5"},
                         {"OFF_X", "0"},
                         {"OFF_Z", "0"},
                         {"FRICTION", "0.2"},
                         {"ANGLE", "0"},
                         {"STATE", "closed = true\nsliding = \"forward\""},
                         {"GIVEN", "given = [\"ball.x\", \"ball.y\", \"ball.orientation\"]"},
                         {"END", "1"},
                         {"PARAMETERS",
                          "\"contact.floor.friction_coefficient\", \"rigid_body.ball.mass_kg\", "
                          "\"rigid_body.ball.inertia_yy_kg_m2\", \"rigid_body.ball.vx_m_per_s\""}});
}

/// One whose centre is not that of its mass and whose moments differ.
inline std::string loaded_ball(SceneWords own) {
  own.insert(own.end(), {{"YY", "0.007"}, {"ZZ", "0.0065"}, {"OFF_X", "0.01"}, {"OFF_Z", "0.02"}});
  return sliding_ball(own);
}

}  // namespace costate::test
