// The work of forces where nothing moves, and where all repeats itself: equilibria, modes and cycles do not see a state
// that only counts what has been done.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/analysis/modes.h"
#include "costate/analysis/start.h"
#include "costate/cycle/cycle.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "gradient_compare.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {
/// An arm with a servo and a winch of formulas, which work.
Scene servo(const std::string& rest, bool work = true) {
  const std::string works = work ? "work = true\n" : "";
  return Scene::parse(R"toml([gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.B]
ground = true
x_m = 1.5
y_m = 0.5
[point.P]
x_m = 0.6
y_m = -0.8
[bar.rod]
from = "A"
to = "P"
mass_kg = 2
[angle.th]
bar = "rod"
[couple.motor]
angle = "th"
formula = "k*(0.3 + swing*sin(2*t) - th) - 0.5*th_dot"
k = 20
swing = 0
)toml" + works + R"toml([actuator.winch]
from = "B"
to = "P"
time_constant_s = 0.1
formula = "(P.y + 2)*gain - 0.2*P.y_dot"
gain = 4
)toml" + works + R"toml([parameter.gain]
number = "actuator.winch.gain"
[parameter.k]
number = "couple.motor.k"
[run]
rtol = 1e-10
)toml" + rest,
                      "servo.toml");
}
}  // namespace

// z' = 0 of the winch, and no word of what has been done: nothing moves.
TEST_CASE("work: an equilibrium and its modes are those without it") {
  const std::string start = "t_end_s = 1\n[start]\nequilibrium = true\n";
  Assembly with(servo(start).mechanism(), {}), without(servo(start, false).mechanism(), {});
  const Start a = find_start(with, 0, false), b = find_start(without, 0, false);
  for (Eigen::Index i = 0; i < b.q.size(); ++i) CHECK(std::abs(a.q[i] - b.q[i]) <= 1e-12);
  REQUIRE(a.z.size() == 3);
  CHECK(a.z[0] == 0);
  CHECK(a.z[1] == Approx(b.z[0]).epsilon(1e-12));
  CHECK(a.z[1] > 5);
  CHECK(a.z[2] == 0);
  const Modes x = find_modes(with, 0, a), y = find_modes(without, 0, b);
  CHECK(x.zero_eigenvalues == y.zero_eigenvalues);
  REQUIRE(x.modes.size() == y.modes.size());
  for (std::size_t i = 0; i < y.modes.size(); ++i) {
    CHECK(std::abs(x.modes[i].eigenvalue - y.modes[i].eigenvalue) <= 1e-10 * std::abs(y.modes[i].eigenvalue));
    REQUIRE(x.modes[i].z.size() == 3);
    CHECK(std::abs(x.modes[i].z[1] - y.modes[i].z[0]) <= 1e-9 * std::abs(y.modes[i].z[0]) + 1e-12);
    CHECK((x.modes[i].z[0] == 0. && x.modes[i].z[2] == 0.));
  }
}

TEST_CASE("work: from an equilibrium that depends on the parameters, the gradient of the integral of the power") {
  const std::string start =
      "t_end_s = 1\n[start]\nequilibrium = true\n[driver.none]\ncoordinate = \"Q.x\"\nlaw = { kind = \"smooth_step\", "
      "from = 0.1, "
      "to = 0.6, before = 0, after = 1 }\n[point.Q]\nx_m = 0\ny_m = 3\n[mass.Q]\npoint = \"Q\"\nmass_kg = 1\n"
      "[driver.still]\ncoordinate = \"Q.y\"\nlaw = 3\n[spring.pull]\nfrom = \"P\"\nto = \"Q\"\nstiffness_N_per_m = 15\n"
      "natural_length_m = 2\n";
  const auto cost = [](const char* kind, const char* what) {
    return fmt::format(
        "[[cost.{0}]]\nkind = \"value\"\noutput = \"motor.{1}\"\n[[cost.{0}]]\nkind = \"value\"\noutput = "
        "\"winch.{1}\"\nweight = 2\n",
        kind, what);
  };
  Problem a = make_problem(servo(start + cost("terminal", "work")), {"gain", "k"}),
          b = make_problem(servo(start + cost("running", "power")), {"gain", "k"});
  for (const char* method : {"cvodes-adjoint", "idas-forward", "hand-adjoint"}) {
    INFO(method);
    const auto rho = a.parameters.values();
    const GradientResult x = gradient(a, method, rho), y = gradient(b, method, rho);
    CHECK(x.psi == Approx(y.psi).epsilon(1e-7));
    CHECK(std::abs(x.psi) > 1e-3);
    CHECK_BELOW(gradient_mismatch(x.gradient, y.gradient, a.parameters), 1e-6);
  }
}

// A motor that swings the arm gives work in every cycle, to the dampers: its state grows on and on, and yet the motion
// repeats itself. The work of a cycle is that from its begin on.
TEST_CASE("work: over a cycle it is the integral of the power") {
  const std::string cycle =
      "t_end_s = 20\nparameters = [\"gain\", \"k\"]\n[start]\ngiven = [\"th\"]\n[cycle]\nperiod_s = "
      "3.141592653589793\n";
  const auto of = [&](const char* kind, const char* what) {
    const Scene scene = servo(cycle + fmt::format("[[cost.{}]]\nkind = \"value\"\noutput = \"motor.{}\"\n", kind, what))
                            .with_override("couple.motor.swing", "0.3");
    const Problem p = make_problem(scene, {"gain", "k"});
    return find_cycle(p, *scene.cycle, p.parameters.values());
  };
  const CycleResult a = of("terminal", "work"), b = of("running", "power");
  CHECK(a.psi.value > 0.01);
  CHECK(a.psi.value == Approx(b.psi.value).epsilon(1e-7));
  REQUIRE(a.multipliers.size() == b.multipliers.size());
  CHECK(a.largest() == Approx(b.largest()).epsilon(1e-6));
  CHECK(a.largest() < 1);
  for (const std::string& name : a.names) CHECK_THAT(name, !Contains("work"));
}
