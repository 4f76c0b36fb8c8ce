// A box on two rough corners, which hold it twice along the ground.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "support/with_words.h"

namespace costate::test {

inline const char* const kRoughBox = R"(
[gravity]
x_m_per_s2 = GX
y_m_per_s2 = -9.81
[body.box]
x_m = 0.7
y_m = 0.2
vx_m_per_s = SPEED
mass_kg = 2
inertia_kg_m2 = 0.1
[point.left]
on = "box"
x_m = -0.3
y_m = -0.2
[point.right]
on = "box"
x_m = 0.3
y_m = -0.2
[point.c]
on = "box"
x_m = 0
y_m = 0
[contact.left]
kind = "rigid"
point = "left"
closed = true
friction = "coulomb"
friction_coefficient = MU_L
LEFT
[contact.right]
kind = "rigid"
point = "right"
closed = true
friction = "coulomb"
friction_coefficient = MU_R
RIGHT
MORE
[start]
given = ["box.x"]
VELOCITIES
[run]
t_end_s = END
rtol = 1e-10
parameters = ["friction", "body.box.mass_kg", "START"]
outputs = ["box.x", "left.normal_force", "right.normal_force", "left.friction_force", "right.friction_force"]
COST
[[cost.terminal]]
kind = "value"
output = "box.x"
[parameter.friction]
numbers = ["contact.left.friction_coefficient", "contact.right.friction_coefficient"]
)";

/// With the words that are given; it rests otherwise, for a second.
inline Problem make_box(const std::vector<std::pair<std::string, std::string>>& words) {
  std::vector<std::pair<std::string, std::string>> all = words;
  for (const auto& [word, by] :
       std::initializer_list<std::pair<const char*, const char*>>{{"SPEED", "0"},
                                                                  {"GX", "0"},
                                                                  {"LEFT", ""},
                                                                  {"RIGHT", ""},
                                                                  {"MORE", ""},
                                                                  {"MU_L", "0.3"},
                                                                  {"MU_R", "0.3"},
                                                                  {"COST", ""},
                                                                  {"VELOCITIES", "given_velocities = []"},
                                                                  {"START", "body.box.x_m"},
                                                                  {"END", "1"}})
    all.emplace_back(word, by);
  std::string scene = kRoughBox;
  for (const auto& [word, by] : all) scene = with_words(scene, {{word, by}});
  return make_problem(Scene::parse(scene, "box.toml"));
}

}  // namespace costate::test
