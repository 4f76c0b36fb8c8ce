// Gradients through every force between bodies of space at once: adjoint and forward against differences of whole runs,
// which use no derivative code.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

const std::string forces = R"re(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.frame]
x_m = 0
y_m = 0.1
z_m = 1
rotation_axis = [1, 2, -1]
angle_rad = 0.4
omega_x_rad_per_s = 0.5
mass_kg = 10
inertia_xx_kg_m2 = 1.2
inertia_yy_kg_m2 = 1.5
inertia_zz_kg_m2 = 1.1

[rigid_body.engine]
x_m = 0.2
y_m = 0.8
z_m = 0.6
rotation_axis = [0, 1, -1]
angle_rad = 0.7
mass_kg = 3
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.25

[point.wall]
ground = true
x_m = 0
y_m = 0.5
z_m = 0.9

[point.seat]
on = "frame"
x_m = 0.1
y_m = 0.3
z_m = -0.2

[point.foot]
on = "engine"
x_m = -0.1
y_m = -0.1
z_m = 0.2

[bushing.mount]
from = "seat"
to = "foot"
rotation_axis_from = [0, 0, 1]
angle_from_rad = 0.3
rotation_axis_to = [1, 0, 0]
angle_to_rad = -0.2
stiffness_N_per_m = [300, 200, 100]
stiffness_N_m_per_rad = [20, 30, 40]
damping_N_s_per_m = [3, 4, 5]
damping_N_m_s_per_rad = [0.3, 0.2, 0.1]
preload_N = [0, 0, 30]
preload_N_m = [0.1, 0, -0.2]

[bushing.tether]
from = "wall"
to = "seat"
stiffness_N_per_m = [100, 100, 100]
stiffness_N_m_per_rad = [10, 10, 15]

[force.push]
point = "foot"
frame = "body"
x_N = { kind = "sine", mean = 1, amplitude = 9, angular_frequency_rad_per_s = 6 }
[couple.spin]
bodies = ["frame", "engine"]
frame = "body"
z_N_m = 0.6
[drag.air]
point = "foot"
drag_coefficient = 0.9
area_m2 = 1.8
wind_x_m_per_s = -2
[axis_spring.leaf]
from = "seat"
to = "foot"
axis = [0.1, 0.2, 1]
natural_length_m = -0.1
stiffness_N_per_m = 100
spring_law = { kind = "bump_stop", gap = 0.2, stiffness = 300, exponent = 2.5, smoothing = 0.2 }
damper_law = { kind = "scaled", slope = 30, nominal_slope = 15, law = { kind = "piecewise", breaks = [-0.2, 0.2], coefficients = [[-2, 5], [0, 15], [2, 5]] } }
[friction.slider]
from = "seat"
to = "foot"
axis = [0, 1, 1]
normal_force_N = 6
static_coefficient = 0.3
dynamic_coefficient = 0.2
transition_velocity_m_per_s = 0.05
[start]
given = ["frame", "engine"]

[[cost.running]]
kind = "square"
output = "foot.z"
[parameter.k]
number = "bushing.mount.stiffness_N_per_m[2]"
[parameter.kt]
number = "bushing.mount.stiffness_N_m_per_rad[0]"
[parameter.area]
number = "drag.air.area_m2"
[parameter.slope]
number = "axis_spring.leaf.damper_law.slope"
[parameter.stop]
number = "axis_spring.leaf.spring_law.gap"
[parameter.mu]
number = "friction.slider.static_coefficient"
[parameter.amplitude]
number = "force.push.x_N.amplitude"
[parameter.torque]
number = "couple.spin.z_N_m"
[run]
t_end_s = 2
parameters = ["k", "kt", "area", "slope", "stop", "mu", "amplitude", "torque"]
)re";

}  // namespace

TEST_CASE("spatial forces: gradients against differences", "[spatial]") {
  const Scene scene = Scene::parse(forces, "forces.toml");
  Problem p;
  p.mechanism = scene.mechanism();
  p.objective = scene.objective();
  p.parameters = p.mechanism->select({});
  p.formulation = "baumgarte";
  p.solver.integrator = "cvodes";
  p.solver.rtol = 1e-10;
  p.solver.t_end = scene.run.t_end_s;
  const std::vector<double> rho = p.parameters.values();
  const GradientResult expected = gradient(p, "differences", rho);
  for (const std::string method : {"cvodes-adjoint", "cvodes-forward"}) {
    const GradientResult found = gradient(p, method, rho);
    double size = 0, error = 0;
    for (std::size_t j = 0; j < rho.size(); ++j) {
      const double scale = p.parameters.parameters[j].scale;
      size = std::max(size, std::abs(expected.gradient[j]) * scale);
      error = std::max(error, std::abs(found.gradient[j] - expected.gradient[j]) * scale);
    }
    INFO(method << ": off by " << error << " of " << size);
    CHECK(error < 1e-6 * size);  // runs and gradients at rtol 1e-10 are good to 1e3 times that; differences to as much
  }
}
