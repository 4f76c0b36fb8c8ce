// Second derivatives of psi across known times at which laws have kinks or jump, and which parameters may move
// (lib/README.md (13.14), (8.2)), against differences of gradients; and what is refused.
#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "property/driven_carriage.h"
#include "property/hessian_compare.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

Problem driven(const std::string& law, std::vector<std::string> names) {
  for (std::string& name : names) name = "driver.push.law." + name;
  for (const char* other : {"body.rod.mass_kg", "point.top.x_m", "spring.strut.stiffness_N_per_m"})
    names.emplace_back(other);
  Problem p = make_problem(Scene::parse(driven_carriage(law), "driver.toml"), names);
  p.solver.rtol = 1e-11;
  return p;
}

}  // namespace

TEST_CASE("hessian instants: kinks of drivers, and jumps of their accelerations, that parameters move") {
  const std::vector<std::pair<const char*, std::vector<std::string>>> laws = {
      {R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })",
       {"start_m", "length_m", "height_m"}},
      {R"({ kind = "bump", height_m = 0.15, start_m = 0.3, length_m = 0.5, shape = "half_sine" })", {"height_m"}},
      {R"({ kind = "bump", height_m = 0.1, start_m = 0.1, length_m = 0.25, shape = "half_sine", count = 3, spacing_m = 0.3 })",
       {"start_m", "length_m", "spacing_m"}},
      {R"({ kind = "bump", height_m = 0.2, start_m = 0.1, length_m = 0.3 })", {"start_m", "length_m"}}};
  for (const auto& [law, names] : laws) {
    INFO(law);
    check_by_differences(driven(law, names), 1e-6);
  }
}

TEST_CASE("hessian instants: a force whose law of time jumps") {
  const std::string scene = R"([point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[mass.P]
point = "P"
mass_kg = 2
[spring.s]
from = "O"
to = "P"
stiffness_N_per_m = 40
natural_length_m = 0.7
[actuator.a]
from = "O"
to = "P"
time_constant_s = 0.2
command_N = { kind = "piecewise", joins = "none", breaks = [0.4, 0.9], coefficients = [[0], [5], [-3]] }
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 1.5
rtol = 1e-11
parameters = ["actuator.a.command_N.breaks[0]", "actuator.a.command_N.breaks[1]", "mass.P.mass_kg", "spring.s.stiffness_N_per_m"]
[[cost.running]]
kind = "square"
output = "P.x"
[[cost.terminal]]
kind = "square"
output = "P.x_dot"
)";
  check_by_differences(make_problem(Scene::parse(scene, "jumps.toml")), 1e-6, {"index1", "baumgarte"});
}
