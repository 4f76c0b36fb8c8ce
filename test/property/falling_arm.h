// A bar that falls onto a floor with its end, several times: constraints that a parameter moves, states that jump.
#pragma once

#include <fmt/format.h>

#include <string>

namespace costate::test {

/// With what the contact is, until when, and a weighted output in the running cost.
inline std::string falling_arm(const std::string& contact, double t_end, const std::string& output, double weight) {
  return fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 1
[point.P]
x_m = 1
y_m = 1
[bar.arm]
from = "A"
to = "P"
mass_kg = 1
length_m = 1
[contact.floor]
point = "P"
{}
ground_height_m = 0.75
[start]
given = ["P.y"]
[run]
t_end_s = {}
[[cost.running]]
kind = "square"
output = "P.y_dot"
[[cost.running]]
kind = "value"
output = "{}"
weight = {}
[[cost.terminal]]
kind = "value"
output = "P.x"
)",
                     contact, t_end, output, weight);
}

}  // namespace costate::test
