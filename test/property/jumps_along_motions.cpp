// What jumps at an instant that the motion decides is no matter for gradients: forces that jump, angles that fold back,
// and laws whose pieces a parameter would part are refused by name, with the place or the time.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene_kind.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using Catch::Contains;

namespace {

std::string case_path(const std::string& name) {
  return fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, name);
}

Problem case_problem(const std::string& name, const std::vector<std::string>& changes = {}) {
  return make_problem(Scene::load(case_path(name), changes));
}

/// One of each family: they share the look at the scene, not the course of the run.
const std::vector<std::pair<const char*, const char*>>& methods() {
  static const std::vector<std::pair<const char*, const char*>> all = {
      {"index1", "idas-adjoint"},  {"index1", "idas-forward"}, {"baumgarte", "cvodes-adjoint"},
      {"penalty", "hand-adjoint"}, {"maggi", "hand-tangent"},  {"index3", "discrete-adjoint"}};
  return all;
}

template <class Matcher>
void check_refused(Problem problem, const Matcher& message) {
  const auto rho = problem.parameters.values();
  for (const auto& [formulation, method] : methods()) {
    INFO(formulation << " " << method);
    problem.formulation = formulation;
    CHECK_THROWS_WITH(gradient(problem, method, rho), message);
  }
}

/// A driven carriage whose law is in two pieces.
std::string driven(const std::string& parameter, const std::string& coefficients) {
  return fmt::format(R"([body.carriage]
x_m = 0
y_m = 0
angle_rad = 0
mass_kg = 2
inertia_kg_m2 = 0.1

[driver.push]
coordinate = "carriage.x"
law = {{ kind = "piecewise", breaks = [0.4], coefficients = {}, joins = "none" }}

[start]
given = ["carriage.y", "carriage.angle"]

[[cost.terminal]]
kind = "value"
output = "carriage.x"

[parameter.p]
{}

[run]
t_end_s = 1
parameters = ["p"]
)",
                     coefficients, parameter);
}

/// The example of a kind of element with changes, over some tenths of a second.
Problem example_problem(const std::string& name, const std::vector<std::string>& changes,
                        const std::vector<std::string>& parameters) {
  const std::string text = find_scene_kind(name)->example;
  const std::string more =
      fmt::format("\n[[cost.terminal]]\nkind = \"value\"\noutput = \"{}\"\n[run]\nt_end_s = 0.2\nparameters = []\n",
                  Scene::parse(text, name).mechanism()->coordinates().front().name);
  return make_problem(Scene::parse(text + more, name, changes), parameters);
}

Problem driven_problem(const std::string& parameter,
                       const std::string& coefficients = "[[0.05, 0.5], [0.05, 0.1, 1]]") {
  return make_problem(Scene::parse(driven(parameter, coefficients), "driven.toml"));
}

}  // namespace

TEST_CASE("a force that jumps is refused in gradients, with its law and place") {
  Problem problem = case_problem("force_that_jumps");
  check_refused(problem,
                Contains("'spring.s.spring_law' jumps from 0 to 2 at x = 0.5") && Contains("joins = \"value\""));
  // Runs go on, and differences of runs know the jump.
  const auto rho = problem.parameters.values();
  CHECK_NOTHROW(simulate(problem, rho));
  CHECK_NOTHROW(gradient(problem, "differences", rho));
  // The same inside other laws.
  for (
      const char* law :
      {R"(spring.s.spring_law={kind="scaled",slope=2,nominal_slope=1,law={kind="piecewise",breaks=[0.5],coefficients=[[0],[2]],joins="none"}})",
       R"law(spring.s.spring_law={kind="formula",formula="atan(1/(x-0.5))"})law",
       R"(spring.s.spring_law={kind="sum",terms=[{kind="piecewise",breaks=[0.5],coefficients=[[0],[2]],joins="none"},{kind="polynomial",coefficients=[0,1]}]})"}) {
    Problem nested =
        make_problem(Scene::load(case_path("force_that_jumps"), {law, R"(parameter.F.number="mass.bob.mass_kg")"}),
                     {"point.P.vx_m_per_s"});
    CHECK_THROWS_WITH(gradient(nested, "idas-adjoint", nested.parameters.values()),
                      Contains("'spring.s.spring_law' jumps") && Contains("x = 0.5"));
  }
}

TEST_CASE("a force that jumps along an axis, a path or a road is refused in gradients") {
  check_refused(
      example_problem(
          "axis_spring",
          {R"(axis_spring.leaf.spring_law={kind="piecewise",breaks=[0.1],coefficients=[[0],[2]],joins="none"})"},
          {"axis_spring.leaf.stiffness_N_per_m"}),
      Contains("'axis_spring.leaf.spring_law' jumps from 0 to 2 at x = 0.1"));
  check_refused(
      example_problem("path_driver",
                      {R"(path_driver.pilot.path={kind="piecewise",breaks=[4.5],coefficients=[[0],[1]],joins="none"})"},
                      {"path_driver.pilot.gain"}),
      Contains("'path_driver.pilot.path' jumps from 0 to 1 at x = 4.5"));
  // A tyre's force holds the slope of its road: a half sine has kinks at its ends, a bump has none.
  const std::string sine = R"(road.hump.law={kind="bump",shape="half_sine",height_m=0.05,start_m=0.5,length_m=3})",
                    bump = R"(road.hump.law={kind="bump",height_m=0.05,start_m=0.5,length_m=3})",
                    step = R"(road.hump.law={kind="piecewise",breaks=[0.5],coefficients=[[0],[0.1]],joins="none"})",
                    early = R"(road.hump.law={kind="bump",shape="half_sine",height_m=0.05,start_m=-3,length_m=2})";
  const std::string number = "rigid_body.frame.mass_kg";
  check_refused(example_problem("road", {sine}, {number}), Contains("slope of the law") && Contains("at x = 0.5"));
  check_refused(example_problem("road", {step}, {number}), Contains("jumps from 0 to 0.1 at x = 0.5"));
  for (const auto& law : {bump, early}) {  // before its ramp a road is level
    Problem passes = example_problem("road", {law}, {number});
    CHECK_NOTHROW(gradient(passes, "idas-adjoint", passes.parameters.values()));
  }
}

TEST_CASE("a jump of a force by a post is carried, wherever parameters move it") {
  const std::string sine = R"(road.rig.law={kind="bump",shape="half_sine",height_m=0.05,start_m=0.1,length_m=0.1})";
  Problem fixed = example_problem("road", {sine}, {"rigid_body.frame.mass_kg"});
  const auto rho = fixed.parameters.values();
  const GradientResult expected = gradient(fixed, "differences", rho);
  for (const auto& [formulation, method] : methods()) {
    if (std::string(method).starts_with("discrete")) continue;
    INFO(formulation << " " << method);
    fixed.formulation = formulation;
    // Scaled by the mass it is 5e-3 of psi, of which some rtol are 1e-5 of it.
    CHECK(gradient(fixed, method, rho).gradient[0] == Catch::Detail::Approx(expected.gradient[0]).epsilon(1e-4));
  }
  // The wheel leaves its plate on the way, and at the end nothing depends on time any more: no word of an invariant.
  Problem moved = example_problem(
      "road",
      {R"(road.rig.law={kind="bump",shape="half_sine",height_m=0.3,start_m=0.1,length_m=0.15})", "road.rig.ramp_s=0.02",
       "tyre.rig.damping_N_s_per_m=30"},
      {"road.rig.law.start_m", "road.rig.law.length_m", "road.rig.speed_m_per_s", "tyre.rig.road_delay_s"});
  moved.solver.t_end = 0.3;
  moved.solver.rtol = 1e-9;
  moved.formulation = "index1";
  const auto values = moved.parameters.values();
  const GradientResult oracle = gradient(moved, "differences", values);
  double size = std::abs(oracle.psi);
  for (const double d : oracle.gradient) size = std::max(size, std::abs(d));
  take_notices();
  for (const auto& [formulation, method] :
       {std::pair("index1", "idas-forward"), std::pair("index1", "cvodes-adjoint"),
        std::pair("baumgarte", "idas-adjoint"), std::pair("penalty", "cvodes-forward"),
        std::pair("maggi", "cvodes-adjoint"), std::pair("maggi-implicit", "idas-adjoint"),
        std::pair("index2", "idas-adjoint"), std::pair("index3", "idas-adjoint"), std::pair("maggi", "hand-adjoint"),
        std::pair("index2", "hand-tangent")}) {
    INFO(formulation << " " << method);
    moved.formulation = formulation;
    const GradientResult r = gradient(moved, method, values);
    // A thousand times rtol of psi, as an adjoint costs.
    for (std::size_t j = 0; j < values.size(); ++j) CHECK(std::abs(r.gradient[j] - oracle.gradient[j]) <= 1e-6 * size);
    for (const std::string& text : take_notices()) CHECK_THAT(text, !Contains("invariant"));
  }
  moved.formulation = "index1";
  CHECK_THROWS_WITH(hessian(moved, values), Contains("moves the time t = 0."));
}

TEST_CASE("a force law whose pieces meet passes, a parameter that parts them is refused") {
  const std::string law =
      R"(spring.s.spring_law={kind="piecewise",breaks=[0.5],coefficients=[[0,1],[-0.5,2]],joins="value"})";
  Problem passes = make_problem(Scene::load(case_path("force_that_jumps"), {law}), {"point.P.vx_m_per_s"});
  CHECK_NOTHROW(gradient(passes, "idas-adjoint", passes.parameters.values()));
  Problem parted =
      make_problem(Scene::load(case_path("force_that_jumps"), {law}), {"spring.s.spring_law.coefficients[1][1]"});
  check_refused(parted,
                Contains("'spring.s.spring_law.coefficients[1][1]' opens a jump in the law 'spring.s.spring_law'") &&
                    Contains("x = 0.5"));
}

TEST_CASE("a parameter that parts the pieces of a driver's law is refused, at its time") {
  // 0.05 + 0.5 t and 0.05 + 0.1 t + t^2 meet at 0.25 m.
  check_refused(driven_problem(R"(number = "driver.push.law.coefficients[1][0]")"),
                Contains("Parameter 'p' opens a jump in the law 'driver.push' at t = 0.4"));
  // Both sides together: still a law that meets.
  Problem both =
      driven_problem(R"(numbers = ["driver.push.law.coefficients[0][0]", "driver.push.law.coefficients[1][0]"])");
  const GradientResult r = gradient(both, "idas-adjoint", both.parameters.values());
  CHECK(r.gradient[0] == Catch::Detail::Approx(1).margin(1e-6));
}

TEST_CASE("a driver whose position jumps is refused in every run") {
  Problem problem = driven_problem(R"(number = "body.carriage.mass_kg")", "[[0, 0.5], [0.3, 0.5]]");
  for (const char* formulation : {"index1", "baumgarte", "maggi"}) {
    problem.formulation = formulation;
    CHECK_THROWS_WITH(simulate(problem, problem.parameters.values()), Contains("'driver.push' jumps at t = 0.4 s"));
  }
  problem.solver.t_end = 0.3;  // not reached
  CHECK_NOTHROW(simulate(problem, problem.parameters.values()));
}

TEST_CASE("an angle that folds back in a running cost is refused at the time it does") {
  // 2 rad/s from 0: half a turn at pi/2 s.
  Problem problem = case_problem("yaw");
  const auto rho = problem.parameters.values();
  CHECK_THROWS_WITH(simulate(problem, rho), Contains("'b.yaw'") && Contains("half a turn at t = 1.5"));
  check_refused(problem, Contains("'b.yaw'") && Contains("half a turn at t = 1."));
  // Before that, psi = integral of w t = w T^2 / 2.
  problem.solver.t_end = 1.5;
  const GradientResult r = gradient(problem, "idas-adjoint", rho);
  CHECK(r.gradient[0] == Catch::Detail::Approx(1.125).epsilon(1e-6));
}

TEST_CASE("a bushing that is turned past half a turn is refused at the time it is") {
  Problem problem = case_problem("bush");
  const auto rho = problem.parameters.values();
  for (const char* formulation : {"index1", "baumgarte", "maggi"}) {
    INFO(formulation);
    problem.formulation = formulation;
    CHECK_THROWS_WITH(simulate(problem, rho), Contains("bushing.bu") && Contains("half a turn"));
  }
}

TEST_CASE("a bushing that comes to half a turn in a motion is not told to be turned at the start") {
  // A disc on its hinge, 8 rad/s against 0.2 N m/rad: omega^2 = 5, half a turn at 0.46 s.
  const Scene scene = Scene::parse(R"toml(
[rigid_body.b]
x_m = 0
y_m = 0
z_m = 0
mass_kg = 1
inertia_xx_kg_m2 = 0.02
inertia_yy_kg_m2 = 0.03
inertia_zz_kg_m2 = 0.04
[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0
[point.P]
on = "b"
x_m = 0
y_m = 0
z_m = 0
[hinge.h]
points = ["O", "P"]
axis_first = [0, 0, 1]
angle = "th"
angular_velocity_rad_per_s = 8
[bushing.k]
from = "O"
to = "P"
stiffness_N_m_per_rad = [1, 1, 0.2]
[start]
given = ["th.angle"]
given_velocities = ["th.angle"]
[run]
t_end_s = 2
rtol = 1e-9
)toml",
                                   "bush.toml");
  Problem problem = make_problem(scene);
  const auto rho = problem.parameters.values();
  for (const char* formulation : {"index1", "baumgarte", "maggi"}) {
    INFO(formulation);
    problem.formulation = formulation;
    CHECK_THROWS_WITH(simulate(problem, rho), Contains("bushing.k") && Contains("half a turn") && Contains("t = 0.4") &&
                                                  !Contains("Turn one of them"));
  }
}

// psi by the default at rtol 1e-11. At 1e-4 the first steps that explicit schemes try are too long for the bushing.
TEST_CASE("jumps along motions: a trial that leads half a turn away is tried shorter") {
  Problem problem = case_problem("bushing_box");
  problem.formulation = "baumgarte";
  for (const char* integrator : {"dopri5", "dop853"})
    for (const double rtol : {1e-3, 1e-4}) {
      CAPTURE(integrator, rtol);
      problem.solver.integrator = integrator;
      problem.solver.set_rtol(rtol);
      CHECK(std::abs(simulate(problem, problem.parameters.values()).psi - 0.25937501) <= 100 * rtol * 0.26);
    }
  CHECK_THROWS_WITH(simulate(case_problem("bushing_box", {"rigid_body.box.e0=0", "rigid_body.box.e1=0",
                                                          "rigid_body.box.e2=1", "rigid_body.box.e3=0"}),
                             problem.parameters.values()),
                    Contains("half a turn apart") && Contains("Turn one of them"));
}
