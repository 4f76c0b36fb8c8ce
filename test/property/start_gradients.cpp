// What the start brings the gradient, by every formulation and adjoint method, against differences of whole runs: start
// numbers as parameters, other velocities given than positions, rates of rotations given, whose rows turn with the
// positions, rows that are redundant, costs at the end alone.
//
// Tolerance: 1e3 rtol of the gradient's size, as in gradients.cpp, and what the differences say of themselves. Steps of
// fixed size are differentiated exactly: their adjoint is their tangent, to 1e-8.
#include <support/compare.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "gradient_compare.h"

using namespace costate;
using namespace costate::test;

namespace {

// A top on a ball joint that a spring pulls at; its Euler parameters and rates are given.
const std::string kTop = R"(
[gravity]
z_m_per_s2 = -9.81
[rigid_body.top]
x_m = 0.1
y_m = 0.3
z_m = 0.9
e0 = 0.9273618495495704
e1 = 0.3
e2 = -0.2
e3 = 0.1
mass_kg = 2
center_z_m = 0.2
inertia_xx_kg_m2 = 0.3
inertia_yy_kg_m2 = 0.4
inertia_zz_kg_m2 = 0.2
omega_x_rad_per_s = 0.4
omega_y_rad_per_s = -0.6
omega_z_rad_per_s = 3
[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0
[point.foot]
on = "top"
x_m = 0.05
y_m = -0.1
z_m = -0.5
[point.head]
on = "top"
x_m = 0
y_m = 0
z_m = 0.6
[spherical.foot]
points = ["O", "foot"]
[start]
given = ["top.e1", "top.e2", "top.e3"]
given_velocities = ["top.omega_x", "top.omega_y", "top.omega_z"]
[run]
t_end_s = 0.4
[parameter.e1]
number = "rigid_body.top.e1"
scale = 0.3
[parameter.e3]
number = "rigid_body.top.e3"
scale = 0.3
[parameter.spin]
number = "rigid_body.top.omega_z_rad_per_s"
[parameter.nutation]
number = "rigid_body.top.omega_x_rad_per_s"
[parameter.foot]
number = "point.foot.z_m"
[parameter.mass]
number = "rigid_body.top.mass_kg"
)";
const std::string kTopEnd = R"([[cost.terminal]]
kind = "square"
output = "head.x_dot"
[[cost.terminal]]
kind = "value"
output = "head.y"
)";

// A body on three equal parallel links, which carry a row too many.
const std::string kSwing = R"(
[gravity]
y_m_per_s2 = -9.81
[body.b]
x_m = 0.6
y_m = -0.8
angle_rad = 0
vy_m_per_s = 0.5
mass_kg = 2
inertia_kg_m2 = 0.5
[point.A0]
ground = true
x_m = -1
y_m = 0
[point.A1]
ground = true
x_m = 0
y_m = 0
[point.A2]
ground = true
x_m = 1
y_m = 0
[point.C0]
on = "b"
x_m = -1
y_m = 0
[point.C1]
on = "b"
x_m = 0
y_m = 0
[point.C2]
on = "b"
x_m = 1
y_m = 0
[distance.d0]
from = "A0"
to = "C0"
length_m = 1
[distance.d1]
from = "A1"
to = "C1"
length_m = 1
[distance.d2]
from = "A2"
to = "C2"
length_m = 1
[start]
given = ["b.x"]
given_velocities = ["b.y"]
[run]
t_end_s = 0.5
[parameter.x]
number = "body.b.x_m"
[parameter.v]
number = "body.b.vy_m_per_s"
[parameter.length]
numbers = ["distance.d0.length_m", "distance.d1.length_m", "distance.d2.length_m"]
[parameter.g]
number = "gravity.y_m_per_s2"
)";
const std::string kSwingEnd = R"([[cost.terminal]]
kind = "square"
output = "b.y_dot"
[[cost.terminal]]
kind = "value"
output = "b.x"
)";
const std::string kSwingRunning = R"([[cost.running]]
kind = "square"
output = "b.y"
)";

/// By how many adjoint methods the gradient was found and is right; what refuses the scene counts as neither.
int check_adjoints(const std::string& text, const std::vector<std::string>& parameters) {
  const Scene scene = Scene::parse(text, "scene of the test");
  int found = 0;
  for (const Formulation& f : formulations()) {
    Problem p = make_problem(scene, parameters);
    p.formulation = f.name;
    p.solver.integrator.clear();
    p.solver.rtol = 1e-9;
    const std::vector<double> rho = p.parameters.values();
    GradientResult oracle;
    for (const SensitivityMethod& m : sensitivity_methods()) {
      if (!m.adjoint || !refusal(m, f).empty()) continue;
      INFO(f.name << ", " << m.name);
      const bool fixed = by_fixed_steps(p, m);
      Problem q = p;
      if (fixed) q.solver.step_s = 1e-2;
      GradientResult r;
      try {
        r = gradient(q, m.name, rho);
      } catch (const Error& e) {
        INFO(e.what());
        CHECK(std::string(e.what()).find("depend on the others") != std::string::npos);
        continue;
      }
      ++found;
      if (fixed) {
        const GradientResult tangent = gradient(q, "discrete-tangent", rho);
        CHECK_BELOW(gradient_mismatch(r.gradient, tangent.gradient, p.parameters), 1e-8);
        continue;
      }
      if (oracle.gradient.empty()) oracle = gradient(p, "differences", rho);
      double uncertain = 0;
      for (std::size_t j = 0; j < rho.size(); ++j)
        uncertain = std::max(uncertain, oracle.gradient_error[j] * p.parameters.parameters[j].scale);
      uncertain /= size_of(oracle.gradient, p.parameters);
      CAPTURE(uncertain);
      CHECK(uncertain < 1e-5);
      CHECK_BELOW(gradient_mismatch(r.gradient, oracle.gradient, p.parameters), 1e3 * p.solver.rtol + 10 * uncertain);
    }
  }
  return found;
}

}  // namespace

TEST_CASE("start gradients: rates of a rotation given, a cost at the end alone", "[start]") {
  CHECK(check_adjoints(kTop + kTopEnd, {"e1", "e3", "spin", "nutation", "foot", "mass"}) >= 10);
}

TEST_CASE("start gradients: redundant rows, another velocity given than the position", "[start]") {
  CHECK(check_adjoints(kSwing + kSwingEnd, {"x", "v", "length", "g"}) >= 5);
  CHECK(check_adjoints(kSwing + kSwingEnd + kSwingRunning, {"x", "v", "length", "g"}) >= 5);
}
