// Scene texts for tests.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "costate/scene/scene.h"

namespace costate::test {

/// A pendulum with a spring: a complete scene in which single places are then replaced.
inline const std::string pendulum = R"(title = "Pendulum"

[gravity]
y_m_per_s2 = -9.81

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

[spring.S1]
from = "A"
to = "P"
stiffness_N_per_m = 100
natural_length_m = 1

[start]
given = ["P.x"]

[parameter.k]
number = "spring.S1.stiffness_N_per_m"
lower = 1
upper = 200

[[cost.running]]
kind = "square"
output = "P.x"
target = 0.5

[run]
t_end_s = 1
parameters = ["k"]

[optimize]
algorithm = "mma"
)";

/// The text with one place replaced; it must occur exactly once.
inline std::string replaced(std::string text, const std::string& place, const std::string& by) {
  const auto at = text.find(place);
  INFO("'" << place << "' must occur once in the text");
  REQUIRE(at != std::string::npos);
  REQUIRE(text.find(place, at + 1) == std::string::npos);
  return text.replace(at, place.size(), by);
}

/// What loading says, or "no error".
inline std::string complaint(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    Scene::parse(text, "s.toml", overrides);
  } catch (const SceneError& e) {
    return e.what();
  }
  return "no error";
}

}  // namespace costate::test
