// Grounds that are upright, at ground_x_m.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

// Between a wall at x = -0.5 and one at 0.7, in the plane and in space: x = x1 + e v (T - t1) behind the first impact
// at t1 = (x0 - x1)/v, and dx/dx1 = 1 + e, dx/dx2 = 0 before the second; behind that, at t2, with x3 = x2 - e^2 v (T -
// t2), t2 = t1 + (x2 - x1)/(e v), dx/dx1 = e^2 v dt2/dx1 = -e^2 (1 + 1/e), dx/dx2 = 1 + e.
TEST_CASE("contact walls: they stand at a place", "[events]") {
  const double x1 = -0.5, x2 = 0.7, v = 2, e = 0.8, t1 = 0.6 / v, t2 = t1 + (x2 - x1) / (e * v);
  for (const bool space : {false, true})
    for (const double T : {0.6, 1.3}) {
      std::string scene = R"(
[point.ball]
x_m = 0.1
y_m = 0
vx_m_per_s = -2
[mass.ball]
point = "ball"
mass_kg = 1
[contact.left]
kind = "rigid"
point = "ball"
restitution = 0.8
ground_x_m = -0.5
ground_angle_rad = -1.5707963267948966
[contact.right]
kind = "rigid"
point = "ball"
restitution = 0.8
ground_x_m = 0.7
ground_angle_rad = 1.5707963267948966
[run]
t_end_s = 1
rtol = 1e-10
parameters = ["contact.left.ground_x_m", "contact.right.ground_x_m"]
[[cost.terminal]]
kind = "value"
output = "ball.x"
)";
      if (space) scene.replace(scene.find("y_m = 0\n"), 8, "y_m = 0\nz_m = 0\n");
      scene += std::string("[start]\ngiven = [\"ball.x\", \"ball.y\"") + (space ? ", \"ball.z\"]\n" : "]\n");
      Problem p = make_problem(Scene::parse(scene, "walls.toml"));
      p.solver.t_end = T;
      const bool twice = T > t2;
      for (const char* method : {"idas-adjoint", "cvodes-forward", "hand-adjoint", "discrete-adjoint"}) {
        CAPTURE(space, T, method);
        const GradientResult r = gradient(p, method, p.parameters.values());
        CHECK(std::abs(r.psi - (twice ? x2 - e * e * v * (T - t2) : x1 + e * v * (T - t1))) <= 1e-9);
        CHECK(std::abs(r.gradient[0] - (twice ? -e * e * (1 + 1 / e) : 1 + e)) <= 1e-8);
        CHECK(std::abs(r.gradient[1] - (twice ? 1 + e : 0)) <= 1e-8);
      }
    }
}

TEST_CASE("contact walls: a height, which moves nothing, is told", "[events]") {
  for (const char* kind : {"rigid\"", "compliant\"\nstiffness_N_per_m_n = 1e4"})
    for (const char* where : {"", "ground_x_m = 0.2\n"}) {
      CAPTURE(kind, where);
      take_notices();
      Scene::parse(fmt::format(R"(
[point.ball]
x_m = -1
y_m = 0
[mass.ball]
point = "ball"
mass_kg = 1
[contact.wall]
kind = "{}
point = "ball"
restitution = 0.5
{}ground_height_m = 0.2
ground_angle_rad = 1.5707963267948966
)",
                               kind, where),
                   "wall.toml");
      const std::vector<std::string> said = take_notices();
      const bool told = std::any_of(said.begin(), said.end(), [](const std::string& s) {
        return s.find("moves nothing: it stands at ground_x_m") != std::string::npos;
      });
      CHECK(told == std::string(where).empty());
    }
}

// A mass that falls along an upright wall: leaning one way this pushes it, the other way it does not follow. Where
// something presses it there, and where nothing is there, no more is said than there is.
TEST_CASE("contact walls: one that bears nothing is told of gradients", "[events]") {
  struct Case {
    const char *push, *method;
    bool told;
  };
  for (const Case& c :
       {Case{"0", "idas-adjoint", true}, Case{"0", "hand-adjoint", true}, Case{"0", "cvodes-forward", true},
        Case{"0", "discrete-adjoint", true}, Case{"-1", "idas-adjoint", false}, Case{"-1", "discrete-adjoint", false},
        Case{"-t", "idas-adjoint", false}}) {
    CAPTURE(c.push, c.method);
    const Problem p = make_problem(Scene::parse(fmt::format(R"(
[point.ball]
x_m = 0
y_m = 1
[mass.ball]
point = "ball"
mass_kg = 1
[gravity]
y_m_per_s2 = -9.81
[force.push]
point = "ball"
formula_x_N = "{}"
[contact.wall]
kind = "rigid"
point = "ball"
closed = true
ground_angle_rad = -1.5707963267948966
[start]
given = ["ball.y"]
given_velocities = ["ball.y"]
[run]
t_end_s = 0.4
parameters = ["contact.wall.ground_angle_rad"]
[[cost.terminal]]
kind = "value"
output = "ball.x"
)",
                                                            c.push),
                                                "wall.toml"));
    take_notices();
    gradient(p, c.method, p.parameters.values());
    const std::vector<std::string> said = take_notices();
    CHECK(std::any_of(said.begin(), said.end(), [](const std::string& text) {
            return text.find("contact.wall is closed from t = 0 s to 0.4 s and bears nothing") != std::string::npos;
          }) == c.told);
  }
}
