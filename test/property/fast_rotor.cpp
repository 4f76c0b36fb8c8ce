// A rotor that spins hundreds of turns in gimbals, among forces by formulas: within a long step Maggi's positions are
// found from both of its ends, so that looking at what happens there costs a few factorizations a look.
#include <catch2/catch.hpp>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {
const char* const kGimbals = R"toml(
[gravity]
z_m_per_s2=-9.81
[rigid_body.o]
x_m=0
y_m=0
z_m=0
rotation_axis=[0.0,0.0,1.0]
angle_rad=0.3
mass_kg=1.0
inertia_xx_kg_m2=0.03
inertia_yy_kg_m2=0.04
inertia_zz_kg_m2=0.05
inertia_xy_kg_m2=0.002
inertia_xz_kg_m2=0.0
inertia_yz_kg_m2=0.001
center_x_m=0.01
center_y_m=0.02
center_z_m=0.0
[point.Po]
on="o"
x_m=0
y_m=0
z_m=0
[rigid_body.i]
x_m=0
y_m=0
z_m=0
rotation_axis=[0.9749983928749352,0.14735659471364057,0.16632548778131884]
angle_rad=1.475170680160752
mass_kg=0.7
inertia_xx_kg_m2=0.02
inertia_yy_kg_m2=0.015
inertia_zz_kg_m2=0.018
inertia_xy_kg_m2=0.001
inertia_xz_kg_m2=0.0
inertia_yz_kg_m2=0.0
center_x_m=0.0
center_y_m=0.0
center_z_m=0.01
[point.Pi]
on="i"
x_m=0
y_m=0
z_m=0
[rigid_body.r]
x_m=0
y_m=0
z_m=0
rotation_axis=[0.9749983928749352,0.14735659471364057,0.16632548778131884]
angle_rad=1.475170680160752
mass_kg=0.5
inertia_xx_kg_m2=0.006
inertia_yy_kg_m2=0.01
inertia_zz_kg_m2=0.006
inertia_xy_kg_m2=0.0
inertia_xz_kg_m2=0.0
inertia_yz_kg_m2=0.0
center_x_m=0.0
center_y_m=0.0
center_z_m=0.0
[point.Pr]
on="r"
x_m=0
y_m=0
z_m=0
[point.G]
ground=true
x_m=0
y_m=0
z_m=0
[hinge.hyaw]
points=["G","Po"]
axis_first=[0,0,1]
angle="yaw"
angular_velocity_rad_per_s=0.2
angle_rad=0.3
[hinge.htilt]
points=["Po","Pi"]
axis_first=[1,0,0]
angle="tilt"
angular_velocity_rad_per_s=0.1
angle_rad=1.45
[hinge.hspin]
points=["Pi","Pr"]
axis_first=[0,1,0]
angle="spin"
angular_velocity_rad_per_s=150.0
angle_rad=0.0
[couple.a]
angle="yaw"
formula="-0.05*yaw.angle_dot+0.02*sin(5*t)"
[couple.b]
angle="tilt"
formula="-0.4*sin(tilt.angle-1)"
[couple.c]
angle="spin"
formula="-D*spin.angle_dot"
D=1e-4
[start]
given=["yaw","tilt","spin"]
given_velocities=["yaw","tilt","spin"]
[[cost.terminal]]
kind="value"
output="spin.angle"
target=0
[parameter.D]
number="couple.c.D"
[parameter.w]
number="hinge.hspin.angular_velocity_rad_per_s"
[run]
t_end_s=4
rtol=1e-9
parameters=["D","w"]
)toml";
}  // namespace

TEST_CASE("a fast rotor in gimbals: its angle, and a look's price") {
  const Scene scene = Scene::parse(kGimbals, "gimbals.toml");
  Problem problem = make_problem(scene);
  problem.formulation = "maggi";
  const auto rho = problem.parameters.values();
  const Simulation s = simulate(problem, rho);
  // Recursive Newton-Euler equations by DOP853 at rtol 1e-12: 587.630971.
  CHECK(s.psi == Approx(587.630971).margin(2e-6));
  // 60 looks a step, of some two each where it has no guess; 7,000 a step before.
  CHECK(s.counters.steps < 1000);
  CHECK(s.counters.factorizations < 100 * s.counters.steps);
  // By differences of the Newton-Euler program: -122001 and 3.9186.
  const GradientResult g = gradient(problem, "cvodes-adjoint", rho);
  CHECK(g.gradient[0] == Approx(-122001).epsilon(1e-5));
  CHECK(g.gradient[1] == Approx(3.9186).epsilon(2e-5));
}
