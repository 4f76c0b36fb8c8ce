// 'costate check' where rigid contacts close.
#include <algorithm>
#include <catch2/catch.hpp>

#include "five_bar.h"
#include "process.h"

using costate::test::costate_json;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

TEST_CASE("check: a rod that slides along the ground has its friction in the equations, too") {
  // It falls on its end, which closes and slides: without lib/README.md (19.6) accelerations are off by 3.5 ranges.
  const WorkingDirectory here;
  costate::test::write_text(here / "rod.toml", R"([gravity]
y_m_per_s2 = -9.81
[body.rod]
x_m = 0
y_m = 1
angle_rad = 0.5
vx_m_per_s = -2
angular_velocity_rad_per_s = 1.5
mass_kg = 1
inertia_kg_m2 = 0.08
[point.P]
on = "rod"
x_m = -0.5
y_m = 0
[contact.end]
point = "P"
kind = "rigid"
friction = "coulomb"
friction_coefficient = 0.3
ground_angle_rad = 0.1
[start]
given = ["rod.x", "rod.y", "rod.angle"]
[[cost.terminal]]
kind = "square"
output = "rod.x"
[run]
t_end_s = 0.5
parameters = ["body.rod.inertia_kg_m2"]
)");
  const Json j = costate_json({"check", "rod.toml", "--no-files", "--formulations", "index1,baumgarte"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("disagreements").empty());
  double farthest = 0;
  for (const Json& m : j.at("motions"))
    if (m.at("status") == "ok") farthest = std::max(farthest, m.at("equations_error").get<double>());
  CHECK(farthest > 0);  // there were motions, and Baumgarte's, whose drift is answered, at 4e-7
  CHECK(farthest < 1e-5);
}
