// Events of compliant contact: what the laws give back, and gradients through touches.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/element/force/contact_laws.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

// A ball of 1 kg that falls on a floor without gravity: one contact, in and out.
std::string thrown(const std::string& law, double e, double n, double mass) {
  return fmt::format(R"(
[point.P]
x_m = 0
y_m = 0.01
vx_m_per_s = 0
vy_m_per_s = -1

[mass.P]
point = "P"
mass_kg = {}

[contact.floor]
point = "P"
law = "{}"
stiffness_N_per_m_n = 1e5
exponent = {}
restitution = {}

[start]
given = ["P.x", "P.y"]

[run]
t_end_s = 1

[[cost.terminal]]
kind = "value"
output = "P.y_dot"
)",
                     mass, law, n, e);
}

std::string replaced(std::string text, const std::vector<std::pair<std::string, std::string>>& with) {
  for (const auto& [from, to] : with)
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
  return text;
}

double speed_after(const std::string& scene, const std::string& formulation) {
  Problem p = make_problem(Scene::parse(scene, "thrown.toml"));
  p.formulation = formulation;
  p.solver.rtol = 1e-12;
  return simulate(p, p.parameters.values()).psi;
}

}  // namespace

// The energy balance of F = K d^n (1 + chi dd/v0) gives the speed with which the bodies part (lib/README.md (17)),
// whatever K, n and mass. At rtol 1e-12 the run is good to some 1e-9 (3e-8 at 1e-11 where e is small and the exponent
// large); the equation is solved to rounding.
TEST_CASE("contact: the restitution that comes out", "[events]") {
  for (int law = 2; law < kNormalLaws - 1; ++law)
    for (const double e : {0.1, 0.5, 0.95})
      for (const auto& [n, mass] : {std::pair{1.0, 0.2},
                                    {1.0, 1.0},
                                    {1.0, 30.0},
                                    {1.5, 0.2},
                                    {1.5, 1.0},
                                    {1.5, 30.0},
                                    {2.5, 0.2},
                                    {2.5, 1.0},
                                    {2.5, 30.0}}) {
        const double chi = damping_ratio(static_cast<NormalLaw>(law), e);
        double low = 0, high = 1;
        for (int k = 0; k < 200; ++k) {
          const double x = 0.5 * (low + high);
          const double r = chi * x < 1 ? chi * (1 + x) - std::log((1 + chi) / (1 - chi * x)) : -1;
          (r > 0 ? low : high) = x;
        }
        CAPTURE(kNormalLawNames[static_cast<std::size_t>(law)], e, n, mass);
        const double out = speed_after(thrown(kNormalLawNames[static_cast<std::size_t>(law)], e, n, mass), "baumgarte");
        CHECK(std::abs(out - 0.5 * (low + high)) <= 1e-8);
      }
}

// Against numbers made apart from here: the same balance, x - ln(1 + x) = -e x - ln(1 - e x) with x = chi, solved in 40
// digits (mpmath), and Hertz's impact, m d'' = -K d^1.5 from v, in closed form:
//   deepest (5 m v^2/4K)^(2/5),   until it leaves 2 sqrt(pi) Gamma(7/5)/Gamma(9/10) of that over v.
TEST_CASE("contact: what comes out, in numbers", "[events]") {
  struct Row {
    double e, hunt_crossley, lankarani_nikravesh, flores;
  };
  for (const Row& row : {Row{0.95, 0.95237015282040576793, 0.95350604514213279663, 0.94682883142526744888},
                         Row{0.7, 0.76799978907847570284, 0.79597259536532850744, 0.68318419973068392606},
                         Row{0.3, 0.58128804180857374814, 0.68422460574944763664, 0.25620790667982423159},
                         Row{0.1, 0.51583261640039564177, 0.66526540675515037673, 0.0694442251515404}})
    for (const auto& [law, expected] : {std::pair{"hunt-crossley", row.hunt_crossley},
                                        {"lankarani-nikravesh", row.lankarani_nikravesh},
                                        {"flores", row.flores}}) {
      CAPTURE(law, row.e);
      CHECK(std::abs(speed_after(thrown(law, row.e, 1.5, 1), "baumgarte") - expected) <= 1e-8);  // as above
    }
  // m = 1 kg, K = 1e6 N/m^1.5, v = 1 m/s, from 10 mm above.
  const auto until = [](const std::string& end, const std::string& output) {
    const std::string scene = replaced(thrown("hertz", 1, 1.5, 1), {{"= 1e5", "= 1e6"},
                                                                    {"restitution = 1\n", ""},
                                                                    {"t_end_s = 1", "t_end_s = 1\nends_when = " + end},
                                                                    {"P.y_dot", output}});
    return speed_after(scene, "baumgarte");
  };
  CHECK(until("{ output = \"floor.penetration_rate\", below = 0 }", "floor.penetration") ==
        Approx(0.0043527528164806206957).epsilon(1e-8));
  CHECK(until("{ output = \"P.y\", above = 0 }", "time") == Approx(0.01 + 0.012811349348246876222).epsilon(1e-8));
}

namespace {

// A disc thrown onto a slope, with spin, that touches and leaves it several times; a spring holds it to a point. Costs
// on positions, on the contact's own force, and at the end.
const std::string bouncing_disc = R"(
[gravity]
y_m_per_s2 = -9.81

[body.disc]
x_m = 0
y_m = 0.3
vx_m_per_s = 0.6
angular_velocity_rad_per_s = 3
mass_kg = 1.5
inertia_kg_m2 = 0.006

[point.C]
on = "disc"
x_m = 0.01
y_m = 0

[point.A]
ground = true
x_m = -0.3
y_m = 0.4

[spring.S]
from = "A"
to = "C"
stiffness_N_per_m = 3
natural_length_m = 0.3

[contact.floor]
point = "C"
law = "LAW"
stiffness_N_per_m_n = 3e4
LAWNUMBERS
radius_m = 0.1
ground_angle_rad = -0.05
friction = "FRICTION"
friction_coefficient = 0.3
FRICTIONNUMBERS

[start]
given = ["disc.x", "disc.y", "disc.angle"]

[run]
t_end_s = 0.9

[[cost.running]]
kind = "square"
output = "floor.normal_force"
weight = 1e-4

[[cost.running]]
kind = "square"
output = "disc.x"
target = 0.4

[[cost.terminal]]
kind = "value"
output = "disc.angle"
)";

}  // namespace

// Gradients through several touches against Richardson differences of whole motions. Each touch is a fresh start on a
// force that is not smooth there (d^1.5), so that errors are some 1e4 to 5e4 rtol (measured at 1e-10 and 1e-12): at
// 1e-11 up to 5e-6 of the largest scaled component by CVODES, 1e-7 by IDAS.
TEST_CASE("contact: gradients through touches", "[events]") {
  const std::vector<std::string> parameters = {"contact.floor.stiffness_N_per_m_n",
                                               "contact.floor.ground_height_m",
                                               "contact.floor.ground_angle_rad",
                                               "contact.floor.radius_m",
                                               "contact.floor.exponent",
                                               "contact.floor.friction_coefficient",
                                               "gravity.y_m_per_s2",
                                               "spring.S.stiffness_N_per_m"};
  struct Case {
    const char *law, *numbers, *friction, *more;
  };
  for (const Case& c : {Case{"hunt-crossley", "restitution = 0.7", "stribeck", "static_coefficient = 0.4"},
                        Case{"kelvin-voigt", "damping_N_s_per_m = 60", "lugre", "bristle_stiffness_per_m = 300"},
                        Case{"hertz", "", "brown-mcphee", "static_coefficient = 0.4"},
                        Case{"flores", "restitution = 0.6", "coulomb", "transition_velocity_m_per_s = 0.05"}}) {
    std::vector<std::string> own = parameters;
    if (std::string(c.numbers).find("restitution") == 0) own.push_back("contact.floor.restitution");
    if (std::string(c.numbers).find("damping") == 0) own.push_back("contact.floor.damping_N_s_per_m");
    const Scene scene = Scene::parse(
        replaced(bouncing_disc,
                 {{"LAWNUMBERS", c.numbers}, {"FRICTIONNUMBERS", c.more}, {"LAW", c.law}, {"FRICTION", c.friction}}),
        "disc.toml");
    Problem p = make_problem(scene, own);
    p.solver.rtol = 1e-11;
    p.formulation = "baumgarte";
    const std::vector<double> rho = p.parameters.values();
    const GradientResult reference = gradient(p, "differences", rho);
    double size = 0;
    for (std::size_t j = 0; j < rho.size(); ++j)
      size = std::max(size, std::abs(reference.gradient[j] * p.parameters.parameters[j].scale));
    for (const auto& [formulation, method] : {std::pair{"baumgarte", "cvodes-forward"},
                                              {"baumgarte", "cvodes-adjoint"},
                                              {"baumgarte", "idas-forward"},
                                              {"index1", "idas-adjoint"},
                                              {"index2", "idas-forward"},
                                              {"index2", "idas-adjoint"},
                                              {"index3", "idas-adjoint"},
                                              {"maggi", "cvodes-adjoint"},
                                              {"maggi-implicit", "idas-forward"},
                                              {"penalty", "idas-adjoint"},
                                              {"penalty", "cvodes-adjoint"}}) {
      p.formulation = formulation;
      const GradientResult r = gradient(p, method, rho);
      CAPTURE(c.law, c.friction, formulation, method);
      CHECK(std::abs(r.psi - reference.psi) <= 1e-7 * std::abs(reference.psi));
      CHECK(r.counters.jumps > (std::string(c.law) == "hertz" ? -1 : 2));
      for (std::size_t j = 0; j < rho.size(); ++j) {
        CAPTURE(own[j], r.gradient[j], reference.gradient[j]);
        CHECK(std::abs(r.gradient[j] - reference.gradient[j]) * p.parameters.parameters[j].scale <= 1e-5 * size);
      }
    }
  }
}

// The budget of memory is that of the whole run, not one a segment: older segments of an adjoint run give up their
// steps and are run again on the way back. Again means from the same state by the same steps but for what rounding does
// to their sizes, so that gradients are the same to far below the tolerance's 1e-9.
TEST_CASE("contact: many events within one budget of memory", "[events]") {
  const std::string scene = R"(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 1
[point.P]
x_m = 1
y_m = 1
[bar.arm]
from = "A"
to = "P"
mass_kg = 1
[contact.floor]
point = "P"
law = "lee-wang"
stiffness_N_per_m_n = 1e6
restitution = 0.99
ground_height_m = 0.95
friction = "lugre"
friction_coefficient = 0.01
[start]
given = ["P.y"]
[run]
t_end_s = 5
rtol = 1e-9
parameters = ["contact.floor.stiffness_N_per_m_n", "contact.floor.restitution", "gravity.y_m_per_s2"]
[[cost.running]]
kind = "square"
output = "P.y_dot"
)";
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "idas-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"index2", "idas-adjoint"},
                                            {"maggi", "cvodes-adjoint"},
                                            {"maggi-implicit", "idas-adjoint"}}) {
    GradientResult r[2];
    for (int k = 0; k < 2; ++k) {
      Problem p = make_problem(Scene::parse(scene, "many.toml"));
      p.formulation = formulation;
      if (k == 1) p.solver.memory_budget_MB = 8;  // two segments
      r[k] = gradient(p, method, p.parameters.values());
    }
    CAPTURE(formulation, method, r[0].counters.jumps);
    CHECK(r[0].counters.jumps > 40);
    CHECK(r[1].counters.jumps == r[0].counters.jumps);
    CHECK(r[1].counters.checkpoints > r[0].counters.checkpoints + 20);
    CHECK(r[1].psi == r[0].psi);
    // A repetition is the same to the bit, but by Maggi's formulations: the search for events in the original solves
    // for positions in between, and each solution is the next one's first guess. There what differs by a rounding leads
    // to other steps, and to a gradient that differs by its own error: the derivative by the restitution changes by
    // 1e-3 of itself from rtol 1e-9 to 1e-10.
    const bool solves_positions = std::string(formulation).starts_with("maggi");
    for (std::size_t j = 0; j < r[0].gradient.size(); ++j)
      CHECK(std::abs(r[1].gradient[j] - r[0].gradient[j]) <=
            (solves_positions ? 1e-3 : 1e-9) * std::abs(r[0].gradient[j]));
  }
}

// A ball thrown up by v under a ceiling at height H: with delta = v^2/2g - H it would rise delta above it. Where that
// is large against errors the velocity at T = 1 s follows from those of the touch, u = sqrt(2 g delta) at t1 = (v -
// u)/g:
//   y'(T) = -e u - g (T - t1),   d/dv = -(1 + e) v/u + 1
// on a rigid ceiling; where it is a hair, either way, errors decide whether it touches: that is told, and a gradient is
// refused by the touch's name.
TEST_CASE("contact: a ceiling that is grazed", "[events]") {
  const double g = 10, v = 4, e = 0.5;
  const auto thrown_up = [&](double delta, const std::string& law) {
    return make_problem(Scene::parse(
        fmt::format(R"(
gravity.y_m_per_s2 = -10
point.P = {{ x_m = 0, y_m = 0, vy_m_per_s = 4 }}
mass.P = {{ point = "P", mass_kg = 1 }}
[contact.ceiling]
{}
point = "P"
ground_angle_rad = 3.141592653589793
ground_height_m = {:.17g}
restitution = 0.5
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 1
rtol = 1e-9
parameters = ["point.P.vy_m_per_s"]
[[cost.terminal]]
kind = "value"
output = "P.y_dot"
)",
                    law == "rigid" ? "kind = \"rigid\"" : "law = \"" + law + "\"\nstiffness_N_per_m_n = 1e9",
                    v * v / (2 * g) - delta),
        "ceiling.toml"));
  };
  for (const char* law : {"rigid", "hunt-crossley"})
    for (const double delta : {1e-3, 1e-10, -1e-10, -1e-3}) {
      const auto told = [](const std::vector<std::string>& said) {
        return std::any_of(said.begin(), said.end(),
                           [](const std::string& s) { return s.find("'contact.ceiling: touch' is grazed") != s.npos; });
      };
      CAPTURE(law, delta);
      Problem p = thrown_up(delta, law);
      p.formulation = "baumgarte";
      const auto rho = p.parameters.values();
      for (const char* method : {"cvodes-adjoint", "cvodes-forward"}) {
        CAPTURE(method);
        take_notices();
        if (std::abs(delta) < 1e-9) {
          CHECK_THROWS_WITH(gradient(p, method, rho), Catch::Contains("ceiling: touch' is grazed") &&
                                                          Catch::Contains("A gradient does not exist"));
          take_notices();
          simulate(p, rho);
          CHECK(told(take_notices()));
          continue;
        }
        const GradientResult r = gradient(p, method, rho);
        CHECK_FALSE(told(take_notices()));
        const double u = delta > 0 ? std::sqrt(2 * g * delta) : 0;
        // A touch of delta = 1e-3 m makes errors v/u = 28 times larger: 1e4 rtol, as elsewhere.
        if (std::string(law) == "rigid" || delta < 0)
          CHECK(r.gradient[0] == Approx(delta > 0 ? 1 - (1 + e) * v / u : 1).epsilon(1e-5));
      }
    }
}
