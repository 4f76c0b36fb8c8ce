// Gradients of discrete methods over forces that bend where something touches: a step over a bend gets its derivative
// wrong by the first order of its length, so that such steps have a bound of their own (lib/README (9)), and only
// those.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"
#include "support/paths.h"

using namespace costate;

namespace {
// A wheel that falls, is pressed and thrown up again, twice.
constexpr const char* kFalling = R"([gravity]
z_m_per_s2 = -9.81
[rigid_body.wheel]
x_m = 0
y_m = 0
z_m = 0.5
mass_kg = 10
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub]
on = "wheel"
x_m = 0
y_m = 0
z_m = 0
[road.floor]
kind = "flat"
[tyre.T]
wheel = "hub"
road = "floor"
model = "ride"
radius_m = 0.3
stiffness_N_per_m = 2e4
damping_N_s_per_m = 50
damping_ramp_m = 0.01
[start]
given = ["wheel"]
[[cost.running]]
kind = "square"
output = "wheel.z"
[parameter.k]
number = "tyre.T.stiffness_N_per_m"
[parameter.z]
number = "rigid_body.wheel.z_m"
[run]
t_end_s = 1.2
rtol = 1e-8
parameters = ["k", "z"]
)";
}  // namespace

TEST_CASE("bends: a tyre that lands and leaves", "[bends]") {
  Problem p = make_problem(Scene::parse(kFalling, "falling.toml"));
  const auto rho = p.parameters.values();
  p.formulation = "baumgarte";
  p.solver.rtol = 1e-11;
  const GradientResult expected = gradient(p, "cvodes-forward", rho);
  p.solver.rtol = 1e-8;
  for (const char* integrator : {"dopri5", "dop853", "radau5"})
    for (const char* method : {"discrete-adjoint", "discrete-tangent"}) {
      CAPTURE(integrator, method);
      p.solver.integrator = integrator;
      take_notices();
      const GradientResult r = gradient(p, method, rho);
      const bool told = !take_notices().empty();
      const auto mismatch = test::gradient_mismatch(r.gradient, expected.gradient, p.parameters);
      INFO(mismatch.text);
      // What is returned without a word is within 1e-4. With one (the damping's ramp ends within the touch, at no place
      // that is known): 1.3e-4 measured.
      CHECK(mismatch.error < (told ? 1e-3 : 1e-4));
    }
}

TEST_CASE("bends: the way back meets the instant at which a stiff tyre lands", "[bends]") {
  // There the adjoint's rate jumps by k/m = 4e3 of it: its step becomes very short.
  Problem p = make_problem(Scene::parse(R"([gravity]
z_m_per_s2 = -9.81
[road.R]
kind = "flat"
[rigid_body.w]
x_m = 0
y_m = 0
z_m = 3
mass_kg = 20
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub]
on = "w"
x_m = 0
y_m = 0
z_m = 0
[tyre.T]
wheel = "hub"
road = "R"
model = "ride"
radius_m = 0.3
stiffness_N_per_m = 80000
[start]
given = ["w"]
[[cost.terminal]]
kind = "square"
output = "w.z"
target = 1.5
[run]
t_end_s = 1
parameters = ["rigid_body.w.z_m"]
)",
                                        "landing.toml"));
  const auto rho = p.parameters.values();
  // In closed form: free fall, half a vibration and more about the static deflection, free flight.
  const double g = 9.81, w = std::sqrt(80000.0 / 20), fall = std::sqrt(2 * 2.7 / g), v = -g * fall, a = g / (w * w),
               b = v / w, pi = std::acos(-1.0), touch = std::fmod(2 * std::atan2(b, a) + 2 * pi, 2 * pi) / w,
               flight = 1 - fall - touch, out = -v, end = 0.3 + out * flight - 0.5 * g * flight * flight;
  const double dfall = 1 / (g * fall), dv = -g * dfall;
  const double dtouch = 2 * a / (a * a + b * b) * dv / w / w;
  const double dend = -dv * flight + (out - g * flight) * (-dfall - dtouch);
  for (const char* formulation : {"index1", "baumgarte", "maggi"})
    for (const char* method : {"cvodes-adjoint", "idas-adjoint"}) {
      if (std::string(formulation) == "maggi" && std::string(method) == "idas-adjoint") continue;  // no residual form
      CAPTURE(formulation, method);
      p.formulation = formulation;
      p.solver.integrator.clear();
      const GradientResult r = gradient(p, method, rho);
      CHECK(r.psi == Approx((end - 1.5) * (end - 1.5)).epsilon(1e-5));
      CHECK(r.gradient[0] == Approx(2 * (end - 1.5) * dend).epsilon(1e-4));
    }
}

TEST_CASE("bends: what stands still has no rates that a step could get wrong", "[bends]") {
  // At rest psi's rates are rounding, and no step is short enough for that.
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/iltis/quarter_car.toml"));
  const auto rho = p.parameters.values();
  for (const char* formulation : {"baumgarte", "index1", "maggi"})
    for (const char* method : {"discrete-adjoint", "discrete-tangent"}) {
      CAPTURE(formulation, method);
      p.formulation = formulation;
      p.solver.integrator = "dop853";
      const GradientResult r = gradient(p, method, rho);
      CHECK(r.counters.steps < 200);
      CHECK(std::abs(r.psi) < 1e-12);
    }
}

TEST_CASE("bends: a damper with two branches that starts at rest", "[bends]") {
  // It stands on its bend; the derivative of the first stage may be that of the branch that it never takes.
  Problem p = make_problem(Scene::parse(R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.3
y_m = -1
[mass.P]
point = "P"
mass_kg = 1
[spring.s]
from = "O"
to = "P"
stiffness_N_per_m = 40
natural_length_m = 1
damper_law = { kind = "piecewise", breaks = [0], coefficients = [[0, 2], [0, 9]] }
[start]
given = ["P.x", "P.y"]
[[cost.running]]
kind = "square"
output = "P.y_dot"
[parameter.vx]
number = "point.P.vx_m_per_s"
[parameter.vy]
number = "point.P.vy_m_per_s"
[run]
t_end_s = 0.2
rtol = 1e-8
parameters = ["vx", "vy"]
)",
                                        "rest.toml"));
  const auto rho = p.parameters.values();
  p.formulation = "baumgarte";
  const GradientResult expected = gradient(p, "cvodes-forward", rho);
  for (const char* integrator : {"dopri5", "dop853"}) {
    CAPTURE(integrator);
    p.solver.integrator = integrator;
    const auto mismatch =
        test::gradient_mismatch(gradient(p, "discrete-adjoint", rho).gradient, expected.gradient, p.parameters);
    INFO(mismatch.text);
    CHECK(mismatch.error < 1e-5);
  }
}

namespace {
// Two bars of some millimetres, with a damper whose branches differ by a tenth: what its bends are to the gradient,
// some 1e-4 of it, is next to nothing to the error of a step.
constexpr const char* kMillimetres = R"([gravity]
x_m_per_s2 = 0
y_m_per_s2 = 0
[point.G0]
ground = true
x_m = 0
y_m = 0
[point.P0]
x_m = -0.00195
y_m = 0.00073
vy_m_per_s = 0
[point.P1]
x_m = -0.000127
y_m = 0.00295
vx_m_per_s = 0
[bar.B0]
from = "G0"
to = "P0"
mass_kg = 1.16
length_m = 0.002084
[bar.B1]
from = "P0"
to = "P1"
mass_kg = 0.626
length_m = 0.002876
[spring.S0]
from = "G0"
to = "P1"
stiffness_N_per_m = 1.01
natural_length_m = 0.002068
damper_law = { kind = "piecewise", breaks = [0], coefficients = [[0, 0.2007], [0, 0.2217]] }
[force.F0]
point = "P1"
x_N = { kind = "sine", mean = 0.01415, amplitude = -0.04147, angular_frequency_rad_per_s = 9.356, phase_rad = 0 }
[force.F1]
point = "P1"
y_N = -0.009527
[start]
given = ["P0.y", "P1.x"]
[[cost.running]]
kind = "square"
output = "P0.y"
weight = 1.345
target = 0.0006914
[[cost.running]]
kind = "square"
output = "P1.y"
weight = 1.121
target = 0.002567
[run]
t_end_s = 0.957
rtol = 1e-8
parameters = ["spring.S0.natural_length_m", "bar.B1.length_m"]
)";
}  // namespace

TEST_CASE("bends: branches of a damper that differ little", "[bends]") {
  Problem p = make_problem(Scene::parse(kMillimetres, "millimetres.toml"));
  const auto rho = p.parameters.values();
  p.formulation = "baumgarte";
  p.solver.rtol = 1e-12;
  const GradientResult expected = gradient(p, "cvodes-forward", rho);
  p.solver.rtol = 1e-8;
  for (const char* formulation : {"baumgarte", "index1", "maggi", "maggi-second-order"})
    for (const char* integrator : {"dopri5", "dop853"})
      for (const char* method : {"discrete-tangent", "discrete-adjoint"}) {
        CAPTURE(formulation, integrator, method);
        p.formulation = formulation;
        p.solver.integrator = integrator;
        take_notices();
        const GradientResult r = gradient(p, method, rho);
        const bool told = !take_notices().empty();
        const auto mismatch = test::gradient_mismatch(r.gradient, expected.gradient, p.parameters);
        INFO(mismatch.text);
        CHECK((told || mismatch.error < 1e-4));
        CHECK(mismatch.error < 1e-3);
        // Charts that come near their ends make more of the tolerance.
        if (std::string(integrator) == "dop853" && std::string(formulation).rfind("maggi", 0) != 0)
          CHECK(mismatch.error < 1e-6);
      }
}

TEST_CASE("maggi: a step past the place where its coordinates turn back does not send the motion back", "[maggi]") {
  Problem p = make_problem(Scene::parse(kMillimetres, "millimetres.toml"));
  const auto rho = p.parameters.values();
  p.formulation = "baumgarte";
  p.solver.rtol = 1e-12;
  const double expected = simulate(p, rho).psi;
  for (const char* formulation : {"maggi", "maggi-second-order", "maggi-implicit"})
    for (const char* integrator : {"dopri5", "dop853", "radau5", "radau9", "cvodes", "idas"}) {
      p.formulation = formulation;
      p.solver.integrator = integrator;
      for (const double rtol : {1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
        CAPTURE(formulation, integrator, rtol);
        p.solver.rtol = rtol;
        double psi = 0;
        try {
          psi = simulate(p, rho).psi;
        } catch (const CapabilityError&) {
          continue;  // no such pair
        }
        // Errors of the steps add up, and a psi of 1e-5 has those of absolute tolerances; another branch is off by a
        // tenth.
        CHECK(std::abs(psi / expected - 1) < std::max(3e3 * rtol, 1e-5));
      }
    }
}

TEST_CASE("bends: a contact out of reach bounds no step of a differentiated run", "[bends]") {
  const auto steps = [](const std::vector<std::string>& set) {
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml", set));
    p.formulation = "baumgarte";
    p.solver.integrator = "dopri5";
    return gradient(p, "discrete-adjoint", p.parameters.values()).counters.steps;
  };
  // But for the first ones, which begin small where a force may bend: 6^8 is a million.
  const long without = steps({}),
             with = steps({"contact.far={point=\"P2\",stiffness_N_per_m_n=1e5,ground_height_m=-50,law=\"hertz\"}"});
  CHECK(std::abs(with - without) <= 12);
}
