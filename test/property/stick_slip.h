// A block that a spring pulls along the ground: it sticks up to a static coefficient and slips with a smaller one. As
// scenes, and as a closed form.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "support/with_words.h"

namespace costate::test {

/// A block on the ground that sticks where it is, with what its contact has besides.
inline std::string block(const char* mass_kg, const char* contact) {
  return fmt::format(R"toml([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
[mass.P]
point = "P"
mass_kg = {}
[contact.floor]
kind = "rigid"
point = "P"
closed = true
along_m = 0
friction = "coulomb"
{}
)toml",
                     mass_kg, contact);
}

/// A block of 2 kg that a spring of 40 N/m pulls, whose other end goes ahead at 0.7 m/s; k and V are numbers.
inline const std::string pulled =
    block("2", "friction_coefficient = 0.3\nstatic_coefficient = 0.5") + R"toml([force.pull]
point = "P"
k = 40
V = 0.7
formula_x_N = "k*(V*t - P.x)"
[start]
given = []
[run]
t_end_s = 3
rtol = 1e-11
formulation = "index1"
parameters = ["contact.floor.friction_coefficient", "contact.floor.static_coefficient", "mass.P.mass_kg", "force.pull.k", "force.pull.V"]
[[cost.terminal]]
kind = "value"
output = "P.x"
)toml";

/// The same block on two feet, pulled at 0.1 m above the ground: the rear one bears less and less of the weight, and of
/// the friction who bears how much is not determined; on three nor who bears the weight.
inline std::string pulled_on_feet(const char* friction, bool three) {
  std::string scene = R"toml([gravity]
y_m_per_s2 = -9.81
[body.b]
mass_kg = 2
inertia_kg_m2 = 0.1
x_m = 0
y_m = 0.2
[point.P]
on = "b"
x_m = 0
y_m = -0.1
[force.pull]
point = "P"
k = 40
V = 0.7
formula_x_N = "k*(V*t - P.x)"
[start]
given = ["b.x"]
given_velocities = []
[run]
t_end_s = 3
rtol = 1e-11
formulation = "index1"
parameters = ["mu", "mu_s", "body.b.mass_kg", "force.pull.k", "force.pull.V"]
[parameter.mu]
numbers = ["contact.rear.friction_coefficient", "contact.front.friction_coefficient"MIDDLE_MU]
[parameter.mu_s]
numbers = ["contact.rear.static_coefficient", "contact.front.static_coefficient"MIDDLE_MU_S]
[[cost.terminal]]
kind = "value"
output = "P.x"
)toml";
  scene = with_words(scene, {{"MIDDLE_MU_S", three ? ", \"contact.middle.static_coefficient\"" : ""},
                             {"MIDDLE_MU", three ? ", \"contact.middle.friction_coefficient\"" : ""}});
  for (const auto& [foot, x] : {std::pair{"rear", -0.3}, {"front", 0.3}, {"middle", 0.12}})
    if (three || *foot != 'm')
      scene += fmt::format(
          "[point.{0}]\non = \"b\"\nx_m = {1}\ny_m = -0.2\n[contact.{0}]\nkind = \"rigid\"\npoint = \"{0}\"\n"
          "closed = true\nfriction = \"coulomb\"\n{2}\n",
          foot, x, friction);
  return scene;
}

// With y = V t - x, w = sqrt(k/m): it begins to slide at k y = mu_s m g; then y - y_k = (y_s - y_k) cos w s + V/w sin w
// s about k y_k = mu_k m g, until y' = V once more, where y = 2 y_k - y_s: w s = 2 pi - 2 atan((y_s - y_k) w/V). Each
// round takes what y has to make up, 2 (y_s - y_k)/V, and the slip. At the end it sticks, and x is V t - y there.
inline long double end_of_pulled(const long double* r, double t_end, std::vector<double>* times) {
  const long double mu = r[0], mu_s = r[1], m = r[2], k = r[3], V = r[4], g = 9.81L, w = std::sqrt(k / m),
                    yk = mu * m * g / k, ys = mu_s * m * g / k,
                    slip = (2 * std::acos(-1.0L) - 2 * std::atan((ys - yk) * w / V)) / w;
  long double t = ys / V, x = 0;
  for (; t + slip < t_end; t += slip + 2 * (ys - yk) / V) {
    x = V * (t + slip) - (2 * yk - ys);
    if (times) times->insert(times->end(), {static_cast<double>(t), static_cast<double>(t + slip)});
  }
  return x;
}

}  // namespace costate::test
