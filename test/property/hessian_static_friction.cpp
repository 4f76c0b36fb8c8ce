// Hessians where friction falls from the static coefficient: f jumps in an instant that multipliers decide, (19.16) of
// lib/README.md.
#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/hessian_compare.h"
#include "property/stick_slip.h"
#include "property/ways_compared.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

/// A block on a slope on which a pendulum swings, pushed back and forth by a force that has a phase.
const char* const kSwung = R"toml([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0
[mass.P]
point = "P"
mass_kg = 1
[point.Q]
x_m = 0.6
y_m = -0.3
[mass.Q]
point = "Q"
mass_kg = 0.8
[distance.rod]
from = "P"
to = "Q"
[contact.floor]
kind = "rigid"
point = "P"
closed = true
along_m = 0
ground_angle_rad = 0.1
friction = "coulomb"
friction_coefficient = 0.2
static_coefficient = 0.35
[force.push]
point = "P"
A = 3
w = 5
b = 0.4
formula_x_N = "A*sin(w*t + b)"
[start]
given = ["Q.x"]
given_velocities = ["Q.x"]
[run]
t_end_s = 1.2
rtol = 1e-11
formulation = "index1"
parameters = ["contact.floor.friction_coefficient", "contact.floor.static_coefficient", "mass.P.mass_kg", "mass.Q.mass_kg", "force.push.A", "force.push.w", "force.push.b", "contact.floor.ground_angle_rad"]
[[cost.terminal]]
kind = "value"
output = "P.x"
[[cost.running]]
kind = "square"
output = "Q.x"
)toml";

}  // namespace

// The time of a fall depends on multipliers, and these on the time.
TEST_CASE("hessian static friction: through falls of friction, against the closed form's", "[events][hessian]") {
  const int feet = GENERATE(0, 2);
  CAPTURE(feet);
  const Problem p =
      unconfirmed(feet > 0 ? pulled_on_feet("friction_coefficient = 0.3\nstatic_coefficient = 0.5", false) : pulled);
  std::vector<long double> h;
  for (const double x : p.parameters.values()) h.push_back(1e-3L * x);
  const auto psi = [](const long double* r) { return end_of_pulled(r, 3, nullptr); };
  check_closed(p, hessian_of(psi, p.parameters.values(), h), 3e-7);
}

TEST_CASE("hessian static friction: through falls that multipliers of a swinging body bring about",
          "[events][hessian]") {
  Problem p = unconfirmed(kSwung);
  const std::vector<double> rho = p.parameters.values();
  const auto names = event_names(gradient(p, "cvodes-adjoint", rho).events);
  CAPTURE(names);
  CHECK(std::count(names.begin(), names.end(), "contact.floor: slip slides") >= 2);
  // Differences of gradients at rtol 1e-11 know as much.
  check_by_differences(p, 1e-6);
}

TEST_CASE("hessian static friction: what is not carried is refused by name", "[events][hessian]") {
  const Problem p = unconfirmed(with_words(kSwung, {{R"("Q.x"])", R"("Q.x", "R.x"])"}}) + R"(
[point.R]
x_m = 3
y_m = 0
[mass.R]
point = "R"
mass_kg = 1
[driver.R]
coordinate = "R.y"
law = { kind = "sine", amplitude = 0.1, angular_frequency_rad_per_s = 2 }
)");
  CHECK_THROWS_WITH(hessian(p, p.parameters.values()), Contains("where friction falls") && Contains("beside a driver"));
}
