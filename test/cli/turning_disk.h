// A disk that turns about an axle under a couple, for the tests of cycles.
#pragma once

#include <string>

namespace costate::test {

/// `couple`: its keys behind `angle`; `more`: the tables behind [start].
inline std::string turning_disk(const std::string& couple, const std::string& angle, const std::string& more) {
  return R"toml([body.d]
x_m = 0
y_m = 0
angle_rad = )toml" +
         angle + R"toml(
mass_kg = 1
inertia_kg_m2 = 1
[point.axle]
ground = true
x_m = 0
y_m = 0
[point.c]
on = "d"
x_m = 0
y_m = 0
[revolute.axle]
points = ["axle", "c"]
[couple.k]
angle = "d"
)toml" + couple +
         "\n[start]\ngiven = [\"d.angle\"]\n[run]\nt_end_s = 20\nrtol = 1e-10\n" + more;
}

}  // namespace costate::test
