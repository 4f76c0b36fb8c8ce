// What is told of an instant: an event where a law of time jumps, an end that an output only leaves behind it.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Matchers::Contains;

namespace {

std::string all_notices() {
  std::string all;
  for (const std::string& s : take_notices()) all += s + "\n";
  return all;
}

}  // namespace

TEST_CASE("told ends: an event in the instant in which a law jumps has derivatives of one side") {
  // From 1 m at 2 m/s^2 the ball strikes at 1 s, where the push begins, or a tenth of a second after it.
  for (const auto& [begins, told] : {std::pair{"1", true}, {"1.1", false}}) {
    CAPTURE(begins);
    Problem p = make_problem(Scene::parse(std::string(R"([gravity]
y_m_per_s2 = -2
[point.P]
x_m = 0
y_m = 1
[mass.m]
point = "P"
mass_kg = 1
[contact.floor]
point = "P"
kind = "rigid"
restitution = 0.5
[force.push]
point = "P"
x_N = { kind = "piecewise", breaks = [)") + begins +
                                              R"(], coefficients = [[0], [3]], joins = "none" }
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.y"
[run]
t_end_s = 1.3
parameters = ["h"]
[parameter.h]
number = "point.P.y_m"
)",
                                          "s.toml"));
    take_notices();
    for (const char* method : {"idas-adjoint", "cvodes-forward", "hand-adjoint", "discrete-tangent"}) {
      CAPTURE(method);
      gradient(p, method, p.parameters.values());
      const std::string said = all_notices();
      CHECK((said.find("where a law of time has a kink or a jump") != std::string::npos) == told);
      if (told) CHECK_THAT(said, Contains("contact.floor") && Contains("at t = 1 s"));
    }
  }
}

TEST_CASE("told ends: an output that begins beyond the level and does not turn comes near to it from the wrong side") {
  // It passes the level at 0.5 s, and "is nearest at t = 0.5 s, where 1e-9 m are missing" had been said.
  const auto falls = [](const char* gravity) {
    return make_problem(Scene::parse(std::string("[gravity]\ny_m_per_s2 = ") + gravity + R"(
[point.P]
x_m = 0
y_m = 1
vy_m_per_s = -1
[mass.m]
point = "P"
mass_kg = 1
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 2
ends_when = { output = "P.y", above = 0.5 }
parameters = []
[[cost.terminal]]
kind = "value"
output = "time"
)",
                                     "s.toml"));
  };
  CHECK_THROWS_WITH(simulate(falls("0"), {}), Contains("passes it the other way, and does not turn"));
  // One that turns at 1.43 s is at 1 - 2 + 0.35 2^2 = 0.4 m at the end: 0.1 m are missing.
  CHECK_THROWS_WITH(simulate(falls("0.7"), {}), Contains("It is nearest at t = 2 s") && Contains("where 0.1 m"));
  take_notices();
}

// x = v t comes to 2 m at 1 s; its end is crossed as well as one can be, whatever the tolerance.
TEST_CASE("told ends: one that is crossed cleanly is not, at any tolerance") {
  Problem p = make_problem(Scene::parse(R"toml([point.P]
x_m = 0
y_m = 0
vx_m_per_s = 2
[mass.m]
point = "P"
mass_kg = 1
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 5
parameters = ["point.P.vx_m_per_s"]
ends_when = { output = "P.x", above = 2.0 }
[[cost.terminal]]
kind = "value"
output = "time"
)toml",
                                        "straight.toml"));
  for (const double rtol : {1e-2, 1e-3, 1e-4, 1e-6})
    for (const char* method : {"idas-adjoint", "cvodes-adjoint", "cvodes-forward", "hand-adjoint"}) {
      CAPTURE(rtol, method);
      p.solver.rtol = rtol;
      take_notices();
      CHECK(std::abs(gradient(p, method, p.parameters.values()).gradient[0] + 0.5) <= 1e-6);
      for (const auto& s : take_notices()) CHECK(s.find("hardly crossed") == std::string::npos);
    }
}
