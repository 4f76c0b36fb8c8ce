// Stops of springs that act for less than what would be one step: a tip that spins freely past them, and a throw that
// just reaches one. They do next to nothing to the heavy things that meet them, so that every integrator follows the
// motion between by steps of any length.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/formulation/formulation.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;

namespace {

// Its lowest point is -0.01 once a turn; the anchor is 1 m below zero.
constexpr const char* kPlane = R"([body.wheel]
x_m = 0
y_m = 0.49
angle_rad = 0.3
angular_velocity_rad_per_s = 3
mass_kg = 1e6
inertia_kg_m2 = 1e6
[point.tip]
on = "wheel"
x_m = 0.5
y_m = 0
[point.anchor]
ground = true
x_m = 0
y_m = -1
[spring.stop]
from = "anchor"
to = "tip"
natural_length_m = 0.2
spring_law = { kind = "bump_stop", gap = 0.8, stiffness = 1, exponent = 1.5 }
)";

// Along an axis of a body that turns with the tip's: the tip's height above the ground's anchor.
constexpr const char* kSpace = R"([gravity]
z_m_per_s2 = 0
[rigid_body.wheel]
x_m = 0
y_m = 0
z_m = 0.49
mass_kg = 1e6
inertia_xx_kg_m2 = 1e6
inertia_yy_kg_m2 = 1e6
inertia_zz_kg_m2 = 1e6
omega_y_rad_per_s = 3
[point.tip]
on = "wheel"
x_m = 0.4
y_m = 0
z_m = 0
[point.anchor]
ground = true
x_m = 0
y_m = 0
z_m = 0
[axis_spring.stop]
from = "anchor"
to = "tip"
axis = [0, 0, 1]
natural_length_m = 0
spring_law = { kind = "bump_stop", gap = 0.1, stiffness = 1, exponent = 1.5 }
)";

// The angle is (t - 6)^2, a parabola that dips 0.01 rad below the stop, for 0.2 s.
constexpr const char* kTurn = R"([body.rotor]
x_m = 0
y_m = 0
angle_rad = 36
angular_velocity_rad_per_s = -12
mass_kg = 1
inertia_kg_m2 = 1e6
[couple.motor]
angle = "rotor"
torque_N_m = 2e6
[torsion_spring.stop]
angle = "rotor"
natural_angle_rad = 0
spring_law = { kind = "bump_stop", gap = 0.01, stiffness = 1, exponent = 1.5 }
)";

struct StopCase {
  const char *name, *scene, *given, *output;
};
constexpr StopCase kStopCases[] = {
    {"between points", kPlane, R"("wheel.x", "wheel.y", "wheel.angle")", "stop.force"},
    {"along an axis", kSpace, R"("wheel")", "stop.force"},
    {"of an angle", kTurn, R"("rotor.x", "rotor.y", "rotor.angle")", "stop.torque"},
};

Problem problem_of(const StopCase& c) {
  const std::string text =
      fmt::format("{}[start]\ngiven = [{}]\n[[cost.running]]\nkind = \"value\"\noutput = \"{}\"\n[run]\nt_end_s = 20\n",
                  c.scene, c.given, c.output);
  return make_problem(Scene::parse(text, "stop.toml"), {});
}

}  // namespace

TEST_CASE("brief stops: every kind of spring, every integrator", "[touch]") {
  for (const StopCase& c : kStopCases) {
    Problem p = problem_of(c);
    p.formulation = "index1";
    p.solver.rtol = 1e-8;
    p.solver.integrator = "dopri5";
    // The oracle: steps of a two-hundredth of what the stop acts for, whose law's second derivative alone jumps.
    Problem fine = p;
    fine.solver.max_step_s = 1e-3;
    const double oracle = simulate(fine, fine.parameters.values()).psi;
    CHECK(std::abs(oracle) > 1e-5);
    for (const char* formulation : {"index1", "baumgarte", "index2", "maggi"})
      for (const char* integrator : {"idas", "cvodes", "dopri5", "dop853"}) {
        CAPTURE(c.name, formulation, integrator);
        p.formulation = formulation;
        p.solver.integrator = integrator;
        if (!find_integrator(integrator).carries(find_formulation(formulation))) continue;
        // Missed, psi is off by one dip in nine or by all of it.
        CHECK(simulate(p, p.parameters.values()).psi == Approx(oracle).epsilon(0.01));
      }
  }
}

TEST_CASE("brief stops: fixed steps that pass over one say so", "[touch]") {
  Problem p = problem_of(kStopCases[0]);
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 0.4;
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()),
                    Contains("passes over a touch: spring.stop is closed from") && Contains("--step"));
}
