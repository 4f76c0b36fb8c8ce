// Events of compliant contact: what the laws give back, and gradients through touches.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

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
      for (const double n : {1.0, 1.5, 2.5}) {
        const double mass = n == 1.5 ? 1 : 0.2;
        const double chi = damping_ratio(static_cast<NormalLaw>(law), e);
        double low = 0, high = 1;
        for (int k = 0; k < 200; ++k) {
          const double x = 0.5 * (low + high);
          const double r = chi * x < 1 ? chi * (1 + x) - std::log((1 + chi) / (1 - chi * x)) : -1;
          (r > 0 ? low : high) = x;
        }
        CAPTURE(kNormalLawNames[static_cast<std::size_t>(law)], e, n);
        const double out = speed_after(thrown(kNormalLawNames[static_cast<std::size_t>(law)], e, n, mass), "baumgarte");
        CHECK(std::abs(out - 0.5 * (low + high)) <= 1e-8);
      }
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

std::string replaced(std::string text, const std::vector<std::pair<std::string, std::string>>& with) {
  for (const auto& [from, to] : with)
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
  return text;
}

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
