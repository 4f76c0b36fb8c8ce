// Joints in space with coordinates, a rack and pinion, a free point and bodies in natural coordinates in one
// mechanism: every formulation's gradient by its integrators' methods against Richardson differences of whole
// runs. Tolerances as in gradients.cpp: N rtol for N = 1e3 steps, plus the oracle's own estimate.
#include <support/variants.h>

#include <catch2/catch.hpp>

#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "gradient_compare.h"

using namespace costate;
using namespace costate::test;

namespace {

const char* const kScene = R"(
[gravity]
y_m_per_s2 = 1
z_m_per_s2 = -9.81

[rigid_body.frame]
x_m = 0
y_m = 0
z_m = 0
rotation_axis = [0, 1, 0]
angle_rad = 0.3
mass_kg = 2
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.3
center_x_m = 0.2

[natural_body.arm]
x_m = 0.8
y_m = 0
z_m = -0.2
rotation_axis = [0.2, 1, 0]
angle_rad = 0.5
mass_kg = 1
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1
inertia_xy_kg_m2 = 0.01

[natural_body.rack]
x_m = 0
y_m = 0
z_m = 0.1
mass_kg = 3
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1

[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0

[point.hub]
on = "frame"
x_m = 0
y_m = 0
z_m = 0

[point.end]
on = "frame"
x_m = 0.8
y_m = 0
z_m = 0

[point.wrist]
on = "arm"
x_m = -0.1
y_m = 0
z_m = 0.1

[point.hand]
on = "arm"
x_m = 0.5
y_m = 0.1
z_m = 0

[point.shoe]
on = "rack"
x_m = 0
y_m = 0
z_m = -0.1

[point.bob]
x_m = 1.2
y_m = 0.1
z_m = -1.2
vy_m_per_s = 0.5

[mass.bob]
point = "bob"
mass_kg = 0.4

[hinge.base]
points = ["O", "hub"]
axis_first = [0, 1, 0]
angle = "a"
angular_velocity_rad_per_s = 0.5

[hinge.elbow]
points = ["end", "wrist"]
axis_first = [0.1, 1, 0]
normal_first = [1, -0.1, 0]
normal_second = [1, -0.1, 0]
angle = "b"
angle_rad = 0.1984261189408803

[translational.guide]
points = ["O", "shoe"]
axis_first = [1, 0, 0.2]
displacement = "rack"

[rack_and_pinion.mesh]
angle = "a"
coordinate = "rack.displacement"
radius_m = 0.2
offset_m = -0.06

[torsion_spring.tendon]
angle = "b"
stiffness_N_m_per_rad = 6
natural_angle_rad = 0.2
damping_N_m_s_per_rad = 0.5

[distance.string]
from = "hand"
to = "bob"

[start]
given = ["a.angle", "b.angle", "bob.x", "bob.y"]

[[cost.running]]
kind = "square"
output = "bob.z"
target = -1

[[cost.running]]
kind = "square"
output = "mesh.reaction"
target = 0
weight = 1e-3

[[cost.terminal]]
kind = "square"
output = "b.angle"
target = 0.5

[run]
t_end_s = 0.5
parameters = ["rack_and_pinion.mesh.radius_m", "torsion_spring.tendon.stiffness_N_m_per_rad", "natural_body.arm.mass_kg",
              "natural_body.arm.center_x_m", "rigid_body.frame.inertia_yy_kg_m2", "point.end.x_m", "mass.bob.mass_kg",
              "hinge.elbow.axis_first[0]", "hinge.base.angular_velocity_rad_per_s"]
)";

}  // namespace

TEST_CASE("gradients of a mechanism with joint coordinates and natural coordinates, in every formulation") {
  const Scene scene = Scene::parse(kScene, "scene");
  constexpr double rtol = 1e-9, steps = 1e3;
  Problem p;
  p.mechanism = scene.mechanism();
  p.objective = scene.objective();
  p.parameters = p.mechanism->select({});
  p.solver.rtol = rtol;
  p.solver.t_end = scene.run.t_end_s;
  const std::vector<double> rho = p.parameters.values();
  const auto oracle_of = [&](const std::string& formulation, const FormulationOptions& options) {
    Problem o = p;
    o.formulation = formulation;
    o.formulation_options = options;
    return gradient(o, "differences", rho);
  };
  const GradientResult exact = oracle_of("baumgarte", {});
  // With alpha = 100 the rack's guide gives by 2 % of its length and psi differs by 0.3 %; with 30 it gives by more
  // than 5 %.
  for (const Variant& v : variants(100)) {
    const GradientResult own =
        v.formulation.rfind("penalty", 0) == 0 ? oracle_of(v.formulation, v.options) : GradientResult();
    const GradientResult& oracle = own.gradient.empty() ? exact : own;
    double error = 0;
    for (std::size_t j = 0; j < rho.size(); ++j)
      error = std::max(error, oracle.gradient_error[j] * p.parameters.parameters[j].scale);
    error /= size_of(oracle.gradient, p.parameters);
    Problem q = p;
    q.formulation = v.formulation;
    q.formulation_options = v.options;
    CAPTURE(v.label, error);
    for (const auto& method : integrator_methods(v.formulation)) {
      CAPTURE(method);
      const GradientResult r = gradient(q, method, rho);
      CHECK(std::abs(r.psi - oracle.psi) <= steps * rtol * std::abs(oracle.psi));
      CHECK_BELOW(gradient_mismatch(r.gradient, oracle.gradient, p.parameters), steps * rtol + 10 * error);
    }
  }
}
