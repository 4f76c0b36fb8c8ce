// The start keeps the branch of its first guess, says where it ends far from it, and begins where nothing is given.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/analysis/modes.h"
#include "costate/analysis/start.h"
#include "costate/analysis/start_remarks.h"
#include "costate/base/error.h"
#include "costate/base/stop.h"
#include "costate/scene/scene.h"

using namespace costate;
using Catch::Contains;

namespace {

/// A four-bar A-B-C-D with A = (0, 0), D = (1, 0), guessed at B = (0, 0.3), C = (0.7, 0.8); a driver holds the crank at
/// 0.
std::string four_bar(double crank, double coupler, double rocker) {
  return fmt::format(R"(
point = {{ A = {{ ground = true, x_m = 0, y_m = 0 }}, D = {{ ground = true, x_m = 1, y_m = 0 }}, B = {{ x_m = 0, y_m = 0.3 }}, C = {{ x_m = 0.7, y_m = 0.8 }} }}
[bar.crank]
from = "A"
to = "B"
length_m = {}
mass_kg = 1
[bar.coupler]
from = "B"
to = "C"
length_m = {}
mass_kg = 2
[bar.rocker]
from = "C"
to = "D"
length_m = {}
mass_kg = 2
[angle.crank]
from = "A"
to = "B"
[driver.motor]
coordinate = "crank.angle"
law = {{ kind = "polynomial", coefficients = [0, 6] }}
)",
                     crank, coupler, rocker);
}

/// A body of space with a point AO at O on the ground.
const std::string kBodyAtGround = R"(
point = { O = { ground = true, x_m = 0, y_m = 0, z_m = 0 }, AO = { on = "A", x_m = 0, y_m = 0, z_m = 0 } }
[rigid_body.A]
mass_kg = 2
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.08
inertia_zz_kg_m2 = 0.06
x_m = 0
y_m = 0
z_m = 0
)";

Start start_of(const std::string& text) {
  const Scene scene = Scene::parse(text, "s.toml");
  Assembly assembly(scene.mechanism(), ParameterSelection{});
  return find_start(assembly, 0, false);
}

}  // namespace

TEST_CASE("start: an angle is that of its line, however far from the first guess of the line", "[start]") {
  // Begun at the guess, where the angle is -0.9273, and led on: not half a turn away.
  for (double angle = -9; angle < 9; angle += 0.3) {
    INFO(angle);
    const std::string arm = fmt::format(R"(
point = {{ A = {{ ground = true, x_m = 0, y_m = 0 }}, P = {{ x_m = 0.6, y_m = -0.8 }} }}
[bar.arm]
from = "A"
to = "P"
mass_kg = 2
[angle.crank]
bar = "arm"
angle_rad = {}
[start]
given = ["crank.angle"]
)",
                                        angle);
    const Start start = start_of(arm);
    CHECK(start.q[2] == Approx(angle));
    CHECK(start.q[0] == Approx(std::cos(angle)).margin(1e-12));
    CHECK(start.q[1] == Approx(std::sin(angle)).margin(1e-12));
  }
}

TEST_CASE("start: a hinge's angle, as a parameter far from the first poses", "[start]") {
  const Scene scene = Scene::parse(kBodyAtGround + R"(
rotation_axis = [0, 1, 0]
angle_rad = 0.1
[hinge.h]
points = ["O", "AO"]
axis_first = [0, 1, 0]
normal_first = [1, 0, 0]
normal_second = [1, 0, 0]
angle = "h"
angle_rad = 1
[start]
given = ["h"]
)",
                                   "s.toml");
  const auto selection = scene.mechanism()->select({"hinge.h.angle_rad"});
  Assembly assembly(scene.mechanism(), selection);
  for (const double angle : {1.0, 1.7, 2.9, 4.0, -2.5}) {
    INFO(angle);
    assembly.set_parameters(&angle);
    const Start start = find_start(assembly, 0, false);
    // e0 and e2 are those of half the angle about y, up to their common sign.
    const double e0 = start.q[3], e2 = start.q[5];
    CHECK(1 - 2 * e2 * e2 == Approx(std::cos(angle)).margin(1e-12));
    CHECK(2 * e0 * e2 == Approx(std::sin(angle)).margin(1e-12));
  }
}

TEST_CASE("start: a four-bar closes on the side of its guess, whatever its lengths", "[start]") {
  int closed = 0;
  for (double crank = 0.15; crank < 0.9; crank += 0.1)
    for (double coupler = 0.4; coupler < 1.5; coupler += 0.1)
      for (double rocker = 0.4; rocker < 1.5; rocker += 0.1) {
        // B = (crank, 0): the triangle B-C-D with its base on y = 0, C above it as the guess is.
        const double base = 1 - crank, x = (base * base + coupler * coupler - rocker * rocker) / (2 * base),
                     y2 = coupler * coupler - x * x;
        if (y2 < 1e-3) continue;  // open, or nearly stretched, where rounding grows with 1 / y
        CAPTURE(crank, coupler, rocker);
        ++closed;
        const Start start = start_of(four_bar(crank, coupler, rocker));
        // Newton's last step leaves some 1e-16 times the condition, 1 / y < 32.
        CHECK(start.q[0] == Approx(crank).epsilon(1e-13));
        CHECK(start.q[2] == Approx(crank + x).margin(1e-13));
        CHECK(start.q[3] == Approx(std::sqrt(y2)).margin(1e-13));
      }
  CHECK(closed > 300);
}

TEST_CASE("start: far from the guess is said, with both values", "[start]") {
  const auto remarks = [](const std::string& text) {
    const Scene scene = Scene::parse(text, "s.toml");
    Assembly assembly(scene.mechanism(), ParameterSelection{});
    return start_remarks(assembly, find_start(assembly, 0, false));
  };
  CHECK(remarks(four_bar(0.3, 0.9, 0.8)).empty());
  const auto far = remarks(four_bar(0.75, 0.9, 0.72));
  REQUIRE(!far.empty());
  CHECK_THAT(far[0], Contains("'C.x' at 1.4582 m") && Contains("first guess 0.7 m"));
}

TEST_CASE("start: what nothing constrains starts as the scene has it, when nothing is given", "[start]") {
  // Plane bodies, with and without an empty list.
  for (const char* lists : {"", "[start]\ngiven = []\n"}) {
    const Start start =
        start_of(std::string("[body.b]\nx_m = 1\ny_m = 2\nangle_rad = 0.5\nvx_m_per_s = 3\nmass_kg = 1\n"
                             "inertia_kg_m2 = 1\n") +
                 lists);
    CHECK(start.q == Eigen::Vector3d(1, 2, 0.5));
    CHECK(start.v == Eigen::Vector3d(3, 0, 0));
  }
  // A body in space, beside a point.
  const Start start = start_of(R"(
[rigid_body.b]
x_m = 1
y_m = 2
z_m = 3
vx_m_per_s = 0.5
omega_z_rad_per_s = 2
mass_kg = 1
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.P]
x_m = 4
y_m = 5
[mass.P]
point = "P"
mass_kg = 1
)");
  CHECK(start.q.size() == 9);
  CHECK(start.q.norm() == Approx(std::sqrt(1 + 4 + 9 + 1 + 16 + 25.0)).epsilon(1e-14));
  CHECK(start.v.norm() == Approx(std::sqrt(0.25 + 1)).epsilon(1e-14));  // e' = omega / 2
  // A body that is welded to the ground has nothing free.
  const Start welded = start_of(kBodyAtGround + R"(
[fixed.h]
points = ["O", "AO"]
axis_first = [0, 1, 0]
)");
  CHECK(welded.v.norm() == 0);
  // What a joint holds is asked for, as ever.
  CHECK_THROWS_WITH(start_of(R"(
point = { A = { ground = true, x_m = 0, y_m = 0 }, P = { x_m = 1, y_m = 0 } }
[bar.arm]
from = "A"
to = "P"
mass_kg = 1
)"),
                    Contains("Too few given positions"));
}

TEST_CASE("start: a formula outside its domain is named as that", "[start]") {
  for (const char* law : {"log(t - 1)", "1/t", "sqrt(0 - 1)"}) {
    const Scene scene = Scene::parse(fmt::format(R"(
[point.P]
x_m = 1
y_m = 0
[mass.P]
point = "P"
mass_kg = 1
[force.push]
point = "P"
x_N = {{ kind = "formula", formula = "{}" }}
y_N = 0
)",
                                                 law),
                                     "s.toml");
    Assembly assembly(scene.mechanism(), ParameterSelection{});
    std::string said = "nothing";
    try {
      find_start(assembly, 0, false);
    } catch (const ModelError& e) {
      said = scene.located(e).what();
    }
    CHECK_THAT(said, Contains("s.toml:10:7") && Contains("force.push") && Contains("not a finite number at t = 0 s") &&
                         Contains("'x_N'"));
  }
}

TEST_CASE("start: a long chain is factored in linear time, and its start can be stopped", "[start]") {
  std::string text = "[point.P0]\nground = true\nx_m = 0\ny_m = 0\n", given;
  for (int i = 1; i <= 600; ++i) {
    text += fmt::format("[point.P{}]\nx_m = {}\ny_m = {}\n[bar.b{}]\nfrom = \"P{}\"\nto = \"P{}\"\nmass_kg = 1\n", i, i,
                        -0.01 * (i % 3), i, i - 1, i);
    given += fmt::format("\"P{}.y\", ", i);
  }
  text += "[start]\ngiven = [" + given + "]\n";
  const Start start = start_of(text);
  for (int i = 1; i <= 600; ++i) REQUIRE(start.q[2 * (i - 1)] == Approx(i).margin(1e-9));
  struct Stopped {};
  const Scene scene = Scene::parse(text, "s.toml");
  set_stop_check(+[] { throw Stopped(); });
  Assembly assembly(scene.mechanism(), ParameterSelection{});
  CHECK_THROWS_AS(find_start(assembly, 0, false), Stopped);
  CHECK_THROWS_AS(Scene::parse(text, "s.toml"), Stopped);
  set_stop_check(nullptr);
}

TEST_CASE("modes: roots keep their digits however far apart they are", "[modes]") {
  for (const double c : {1e-6, 1.0, 4e5, 1e9, 1e12}) {
    const Scene scene = Scene::parse(fmt::format(R"(
point = {{ A = {{ ground = true, x_m = 0, y_m = 0 }}, p1 = {{ on = "one", x_m = 0, y_m = 0 }}, p2 = {{ on = "two", x_m = 0, y_m = 0 }} }}
[body.one]
x_m = 0
y_m = 0
mass_kg = 1
inertia_kg_m2 = 1
[body.two]
x_m = 0
y_m = 0
mass_kg = 1
inertia_kg_m2 = 1
[revolute.one]
points = ["A", "p1"]
[revolute.two]
points = ["A", "p2"]
[torsion_spring.s1]
angle = "one"
stiffness_N_m_per_rad = 1
damping_N_m_s_per_rad = 0.1
[torsion_spring.s2]
angle = "two"
stiffness_N_m_per_rad = 1
damping_N_m_s_per_rad = {:.17g}
[start]
given = ["one.angle", "two.angle"]
)",
                                                 c),
                                     "s.toml");
    Assembly assembly(scene.mechanism(), ParameterSelection{});
    const Modes r = find_modes(assembly, 0, find_start(assembly, 0, false));
    CAPTURE(c);
    CHECK(r.zero_eigenvalues == 0);
    // x^2 + c x + 1 = 0 for each; roots in pairs with the product 1. Their errors: rounding of the numbers, some 1e-15.
    std::vector<std::complex<double>> expected = {{-0.05, std::sqrt(1 - 0.0025)}};
    if (c < 2) {
      expected.emplace_back(-c / 2, std::sqrt(1 - c * c / 4));
    } else {
      const double large = -(c + std::sqrt(c * c - 4)) / 2;
      expected.emplace_back(large, 0);
      expected.emplace_back(1 / large, 0);
    }
    REQUIRE(r.modes.size() == expected.size());
    for (const auto& e : expected) {
      double nearest = HUGE_VAL;
      for (const Mode& mode : r.modes) nearest = std::min(nearest, std::abs(mode.eigenvalue - e) / std::abs(e));
      CHECK(nearest < 1e-13);
    }
    for (const Mode& mode : r.modes) CHECK(mode.relative_error < 1e-13);
  }
}
