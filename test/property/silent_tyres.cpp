// The Magic Formula without a slip speed, and with an effective radius that is given as zero: gradients of the wrong
// sign were printed where a wheel comes to rest and rolls back, and a psi that jumped by 4 % for a change of 1e-9.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using Catch::Matchers::Contains;

namespace {

/// A body on one wheel that a force of -30 N stops at 1 s and drives back.
Problem rolling(const std::string& of_tyre, const std::string& formulation) {
  const std::string text = R"([gravity]
z_m_per_s2 = -9.81
[rigid_body.b]
mass_kg = 100.0
x_m = 0.0
y_m = 0.0
z_m = 0.193
inertia_xx_kg_m2 = 2e4
inertia_yy_kg_m2 = 2e4
inertia_zz_kg_m2 = 2e4
vx_m_per_s = 0.3
vy_m_per_s = 0.05
[point.c]
on = "b"
x_m = 0
y_m = 0
z_m = 0
[force.f]
point = "c"
x_N = -30.0
[road.r]
kind = "flat"
[tyre.t]
wheel = "c"
road = "r"
model = "magic_formula"
tir_file = "formula_student_61.tir"
stiffness_N_per_m = 100000.0
radius_m = 0.2025
damping_N_s_per_m = 2000.0
)" + of_tyre + R"(
[[cost.terminal]]
kind = "square"
output = "b.omega_z"
weight = 1e6
[start]
given = ["b.x", "b.y", "b.z", "b.e1", "b.e2", "b.e3"]
given_velocities = ["b.x", "b.y", "b.z", "b.omega_x", "b.omega_y", "b.omega_z"]
[run]
t_end_s = 1.5
rtol = 1e-8
parameters = ["vx"]
[parameter.vx]
number = "rigid_body.b.vx_m_per_s"
)";
  Problem p = make_problem(Scene::parse(text, COSTATE_SOURCE_DIR "/models/tyres/scene.toml"));
  p.formulation = formulation;
  return p;
}

}  // namespace

TEST_CASE("silent tyres: moments that turn at once where a wheel rolls back are in no gradient") {
  const std::string lagging = "free_rolling = true\nrelaxation_length_m = 0.3\nslip_speed_m_per_s = 0\n";
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-adjoint"},
                                            {"baumgarte", "idas-forward"},
                                            {"index1", "cvodes-forward"},
                                            {"baumgarte", "hand-tangent"},
                                            {"baumgarte", "hand-adjoint"},
                                            {"index3", "discrete-adjoint"}}) {
    CAPTURE(formulation, method);
    const Problem p = rolling(lagging, formulation);
    CHECK_THROWS_WITH(gradient(p, method, p.parameters.values()),
                      Contains("passes the forward speed 0") && Contains("slip_speed_m_per_s (0.1)"));
    take_notices();
  }
  // A slip that does not lag is cut at 0.1 m/s, before the wheel stops.
  const Problem p = rolling("free_rolling = true\nslip_speed_m_per_s = 0\n", "baumgarte");
  CHECK_THROWS_AS(gradient(p, "idas-forward", p.parameters.values()), SolverError);
  take_notices();
  // As it is by default there is nothing to refuse; psi's derivative is that of differences of runs.
  const Problem rounded = rolling("free_rolling = true\nrelaxation_length_m = 0.3\n", "baumgarte");
  const auto rho = rounded.parameters.values();
  const double exact = gradient(rounded, "idas-adjoint", rho).gradient[0];
  CHECK(exact == Approx(gradient(rounded, "differences", rho).gradient[0]).epsilon(1e-4));
  take_notices();
}

TEST_CASE("silent tyres: an effective radius whose coefficients are given as zero is the free one") {
  const auto psi = [](const std::string& coefficients) {
    const Problem p = rolling("magic_formula = { " + coefficients + " }\nslip_speed_m_per_s = 0.1\n", "baumgarte");
    return simulate(p, p.parameters.values()).psi;
  };
  const double zero = psi("BREFF = 8, DREFF = 0, FREFF = 0"), near = psi("BREFF = 8, DREFF = 0, FREFF = 1e-9");
  // Tolerances of 1e-8 over some hundred of steps.
  CHECK(zero == Approx(near).epsilon(1e-6));
  take_notices();
}

// Where the normal force acted there as well it drove the wheel: 38 kJ in 1.5 s, of a car that rolls straight on.
TEST_CASE("silent tyres: a trail turns the wheel about its normal by the side force alone") {
  const auto run = [](double trail, double aside, double end, const char* output) {
    const std::string text = fmt::format(R"([gravity]
z_m_per_s2 = -9.81
[rigid_body.b]
mass_kg = 100
x_m = 0
y_m = 0
z_m = 0.29
vx_m_per_s = 10
vy_m_per_s = {}
inertia_xx_kg_m2 = 2e4
inertia_yy_kg_m2 = 2e4
inertia_zz_kg_m2 = 2e4
[point.c]
on = "b"
x_m = 0
y_m = 0
z_m = 0
[rotor.w]
on = "b"
axis = [0, 1, 0]
inertia_kg_m2 = 0.8
spin_rad_per_s = 33
[road.r]
kind = "flat"
[tyre.t]
wheel = "c"
road = "r"
model = "linear"
spin = "w.spin_angle"
radius_m = 0.3
stiffness_N_per_m = 1e5
damping_N_s_per_m = 500
cornering_stiffness_N_per_rad = 4e4
trail_m = {}
[start]
given = ["b", "w.spin_angle"]
[run]
t_end_s = {}
rtol = 1e-10
[[cost.terminal]]
kind = "value"
output = "{}"
)",
                                         aside, trail, end, output);
    const Problem p = make_problem(Scene::parse(text, "scene.toml"));
    return simulate(p, p.parameters.values()).psi;
  };
  CHECK(run(0.02, 0, 0.5, "w.spin") == Approx(33).epsilon(1e-9));
  // In the first moment -trail F_y/I of F_y = -C vy/vx, which falls by 4 % in 1 ms.
  const double turned = 1e-3 * 0.02 * 4e4 * std::atan(0.5 / 10) / 2e4;
  CHECK(run(0.02, 0.5, 1e-3, "b.omega_z") == Approx(turned).epsilon(0.03));
  // What the wheel's spin makes of the roll is 1e-5 of that.
  CHECK(std::abs(run(0, 0.5, 1e-3, "b.omega_z")) < 1e-4 * turned);
  take_notices();
}

// -71 N m of the file were left out without a word.
TEST_CASE("silent tyres: free rolling says that it leaves out the file's rolling resistance") {
  const auto told = [](const std::string& of_tyre) {
    take_notices();
    rolling(of_tyre, "baumgarte");
    std::string all;
    for (const std::string& text : take_notices()) all += text;
    return all;
  };
  CHECK_THAT(told("free_rolling = true\n"), Contains("tyre.t.free_rolling") && Contains("no rolling resistance"));
  const std::string none =
      "magic_formula = { QSY1 = 0, QSY2 = 0, QSY3 = 0, QSY4 = 0, QSY5 = 0, QSY6 = 0, QSY7 = 0, QSY8 = 0 }\n";
  CHECK_THAT(told("free_rolling = true\n" + none), !Contains("rolling resistance"));
  CHECK_THAT(told(""), !Contains("rolling resistance"));
}
