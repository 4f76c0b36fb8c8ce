// costate check where things rest: noise is compared with what moves beside it, with forces and with the tolerances of
// the states, and is no disagreement.
#include <catch2/catch.hpp>

#include "process.h"
#include "support/paths.h"

using costate::test::costate_json;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

TEST_CASE("check: what rests is known to the tolerance of what moves beside it") {
  // A rod that hangs still beside a mass that falls: penalty's accelerations of it are 8e-9 m/s^2 of 9.81, not 0.
  const WorkingDirectory here;
  costate::test::write_text(here / "rest.toml", R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0
y_m = -0.7
[bar.rod]
from = "O"
to = "P"
mass_kg = 2
length_m = 0.7
[point.Q]
x_m = 3
y_m = 0.2
vx_m_per_s = 0.3
[mass.q]
point = "Q"
mass_kg = 1
[start]
given = ["P.x", "Q.x", "Q.y"]
[[cost.running]]
kind = "square"
output = "Q.y"
[parameter.m]
number = "mass.q.mass_kg"
[run]
t_end_s = 2
parameters = ["m"]
)");
  const Json j = costate_json({"check", "rest.toml", "--no-files", "--formulations", "penalty,index1"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("disagreements").empty());
}

TEST_CASE("check: where everything rests, what rounding makes of it is no disagreement") {
  // A truss without freedoms: velocities are 1e-12 to 1e-17 m/s, accelerations up to 1e-8 m/s^2 by penalty, and no two
  // formulations have the same ones. Costs of velocities, in their square and as they are.
  const WorkingDirectory here;
  for (const std::string kind : {"square", "value"}) {
    INFO(kind);
    costate::test::write_text(here / "truss.toml", R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.G]
ground = true
x_m = 0.9
y_m = 0.1
[point.P]
x_m = 0.4
y_m = 0.83
[point.R]
x_m = 1.3
y_m = 0.9
[bar.a]
from = "O"
to = "P"
mass_kg = 1.3
length_m = 0.92
[bar.b]
from = "G"
to = "P"
mass_kg = 0
length_m = 0.88
[bar.c]
from = "P"
to = "R"
mass_kg = 0.7
length_m = 0.91
[bar.d]
from = "G"
to = "R"
mass_kg = 0
length_m = 0.89
[[cost.running]]
kind = ")" + kind + R"("
output = "R.x_dot"
[run]
t_end_s = 1.3
parameters = ["point.G.x_m", "bar.a.mass_kg"]
)");
    // Without penalty-second-order: its hand-derived adjoint holds alpha times what rounding leaves of the constraints.
    const Json j = costate_json({"check", "truss.toml", "--no-files", "--formulations",
                                 "index1,index2,index3,baumgarte,augmented-lagrangian,penalty,maggi,maggi-implicit,"
                                 "maggi-second-order"},
                                here.path());
    CHECK(j.at("status") == "ok");
    CHECK(j.at("disagreements").empty());
    CHECK(j.at("inaccurate").empty());
  }
}

TEST_CASE("check: hand-derived adjoints of which a part is zero") {
  // psi does not know where a free body is: that part of the adjoint is rounding, which no step is short enough for
  // (they needed 1,701 steps of 1e-10 s).
  const WorkingDirectory here;
  costate::test::write_text(here / "free.toml", R"([gravity]
x_m_per_s2 = 0.3
y_m_per_s2 = -9.81
[body.plate]
x_m = 0.178789300398465
y_m = 0.9735767322214541
angle_rad = 0.4
vx_m_per_s = 0.5
angular_velocity_rad_per_s = 2.0
mass_kg = 3.0
inertia_kg_m2 = 0.7
center_x_m = 0.1
center_y_m = -0.05
[start]
given = ["plate.x", "plate.y", "plate.angle"]
[[cost.running]]
kind = "square"
output = "plate.angle_dot"
target = -0.487
[run]
t_end_s = 0.137
rtol = 1e-8
parameters = ["body.plate.vx_m_per_s", "body.plate.angular_velocity_rad_per_s"]
)");
  const Json j =
      costate_json({"check", "free.toml", "--no-files", "--no-motions", "--methods", "hand-adjoint"}, here.path());
  CHECK(j.at("status") == "ok");
  for (const Json& row : j.at("rows"))
    if (row.at("status") != "refused") CHECK(row.at("counters").at("backward_steps").get<int>() < 100);
}

// Two corners hold a box as it slides: that it does not turn is what is left of their moments, of 100 rad/s^2 each. The
// penalties' 6e-10 rad/s^2 for 0 had been a disagreement, with status 3.
TEST_CASE("check: what reactions leave of a turn is known to the tolerance of these") {
  const WorkingDirectory here;
  const Json j = costate_json({"check", COSTATE_MODELS_DIR "/sliding_box/sliding_box.toml", "--no-files"}, here.path());
  CHECK(j.at("status") == "ok");
  for (const Json& row : j.at("motions")) {
    CAPTURE(row.dump());
    CHECK(row.at("status") != "disagreement");
  }
}
