// Rigid contacts that close, stick and open again, against closed forms and independent programs: a rocking block, a
// rimless wheel, balls that roll, walkers.
#include <fmt/format.h>
#include <support/paths.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

Problem rigid_model(const std::string& path, double rtol = 1e-11) {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/" + path));
  p.solver.rtol = rtol;
  return p;
}

}  // namespace

// A block of half-width b and half-height h, tan a = b/h, turns by r = 1 - 3/2 sin^2 a as fast behind an impact. At
// each it stands upright, so that what impacts take falls by r^2. Runs at rtol 1e-12 have r to some 1e-9; the penalty's
// weight leaves a part in 1e8 of an impulse, ten times that here.
TEST_CASE("rigid contacts: a rocking block", "[events]") {
  const double b = 0.2, h = 0.6, g = 9.81, R = std::hypot(b, h), a = std::atan2(b, h);
  const double r = 1 - 1.5 * std::pow(std::sin(a), 2), first = g * (R * std::cos(a - 0.15) - h);
  for (const char* formulation : {"index1", "index2", "baumgarte", "penalty", "maggi", "maggi-implicit"}) {
    Problem p = rigid_model("rocking_block/rocking_block.toml", 1e-12);
    p.formulation = formulation;
    const double tolerance = std::string(formulation) == "penalty" ? 1e-7 : 1e-8;
    const Simulation s = simulate(p, p.parameters.values());
    CAPTURE(formulation);
    REQUIRE(s.events.size() == 10);
    const auto taken = [&](int k) { return s.events[static_cast<std::size_t>(k)].energy_lost; };
    CHECK(std::abs(taken(0) / ((1 - r * r) * first) - 1) <= 2 * tolerance);
    for (int k = 0; k < 10; ++k) {
      const RunEvent& e = s.events[static_cast<std::size_t>(k)];
      CAPTURE(k, e.t);
      CHECK(e.mode == "closed");
      CHECK(e.name == (k % 2 == 0 ? "contact.left: touch" : "contact.right: touch"));
      if (k > 0) CHECK(std::abs(std::sqrt(taken(k) / taken(k - 1)) - r) <= tolerance);
    }
    CHECK(std::abs(std::sqrt(taken(9) / taken(0)) - std::pow(r, 9)) <= tolerance);
  }
}

// With the wheel's inertia J beside m l^2 it turns by (J + m l^2 cos 2a)/(J + m l^2) as fast behind an impact; J is a
// millionth here, and the closed form's numbers (independent, J = 0) move by as much.
TEST_CASE("rigid contacts: a rimless wheel", "[events]") {
  Problem p = rigid_model("rimless_wheel/rimless_wheel.toml");
  const Simulation s = simulate(p, p.parameters.values());
  REQUIRE(s.events.size() == 4);
  for (int k = 0; k < 4; ++k) {
    CAPTURE(k, s.events[static_cast<std::size_t>(k)].t);
    CHECK(s.events[static_cast<std::size_t>(k)].name == fmt::format("contact.s{}: touch", k + 1));
    if (k > 0)
      CHECK(std::abs(s.events[static_cast<std::size_t>(k)].t - s.events[static_cast<std::size_t>(k - 1)].t -
                     1.034549811423279329) <= 5e-6);
    const double before = 1.5492184049054593, after = 1.0954628396476568;
    CHECK(std::abs(s.events[static_cast<std::size_t>(k)].energy_lost - 0.5 * (before * before - after * after)) <=
          1e-5);
  }
}

namespace {

// A wheel on a plane that falls along x, which touches it at the start; of the inertia of a ball.
std::string rolling_wheel(double slope, double mu, bool closed, double height) {
  return fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81
[body.wheel]
x_m = {}
y_m = {}
mass_kg = 1.3
inertia_kg_m2 = {}
[point.C]
on = "wheel"
x_m = 0
y_m = 0
[contact.floor]
kind = "rigid"
point = "C"
radius_m = 0.1
ground_angle_rad = {}
friction = "coulomb"
friction_coefficient = {}
{}
[start]
given = [{}]
[run]
t_end_s = 1
rtol = 1e-11
formulation = "index1"
method = "cvodes-adjoint"
parameters = ["contact.floor.radius_m", "contact.floor.ground_angle_rad", "body.wheel.inertia_kg_m2", "body.wheel.mass_kg", "gravity.y_m_per_s2"]
[[cost.terminal]]
kind = "value"
output = "wheel.x"
)",
                     0.1 * std::sin(slope), 0.1 * std::cos(slope) + height, 0.4 * 1.3 * 0.01, -slope, mu,
                     closed ? "closed = true\nalong_m = 0" : "",
                     closed ? "\"wheel.angle\"" : "\"wheel.x\", \"wheel.y\", \"wheel.angle\"");
}

}  // namespace

// It rolls with 5/7 g sin(slope) while mu >= 2/7 tan(slope), and then says that it slips. Behind a plastic impact that
// sticks it rolls on with 5/7 of the speed along the plane.
TEST_CASE("rigid contacts: a ball rolls", "[events]") {
  const double slope = 0.3, g = 9.81;
  for (const char* formulation : {"index1", "index2", "baumgarte", "penalty", "maggi", "maggi-implicit"})
    for (const char* method : {"cvodes-adjoint", "idas-forward", "idas-adjoint"}) {
      const bool explicit_method = std::string(method) == "cvodes-adjoint", maggi = std::string(formulation) == "maggi";
      if (explicit_method && (std::string(formulation) == "index2" || std::string(formulation) == "maggi-implicit"))
        continue;  // no explicit form
      if (!explicit_method && maggi) continue;
      Problem p = make_problem(Scene::parse(rolling_wheel(slope, 0.2, true, 0), "wheel.toml"));
      p.formulation = formulation;
      const GradientResult r = gradient(p, method, p.parameters.values());
      CAPTURE(formulation, method);
      const double s = 0.5 * 5.0 / 7 * g * std::sin(slope);
      // along_m = 0: the place of the touch, at the angle 0.
      CHECK(std::abs(r.psi - (s * std::cos(slope) + 0.1 * std::sin(slope))) <= 1e-8);
      // By the angle of the ground, which rises by -slope; by gravity; by the inertia: 1/(1 + J/(m R^2)).
      const double by_angle = -(0.5 * 5.0 / 7 * g * std::cos(2 * slope) + 0.1 * std::cos(slope));
      CHECK(std::abs(r.gradient[1] - by_angle) <= 1e-7);
      CHECK(std::abs(r.gradient[4] + s * std::cos(slope) / g) <= 1e-7);
      CHECK(std::abs(r.gradient[2] + s * std::cos(slope) * (5.0 / 7) / (1.3 * 0.01)) <= 1e-6);
    }
  Problem p = make_problem(Scene::parse(rolling_wheel(slope, 0.05, true, 0), "wheel.toml"));
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("contact.floor"));
  // Dropped by 0.2 m onto a gentle slope, with enough friction for the impact.
  p = make_problem(Scene::parse(rolling_wheel(0.1, 2, false, 0.2), "wheel.toml"));
  const Simulation s = simulate(p, p.parameters.values());
  REQUIRE(s.events.size() == 1);
  CHECK(s.events[0].mode == "closed");
  const double fall = std::sqrt(0.4 / g), along = 5.0 / 7 * g * fall * std::sin(0.1), left = 1 - fall;
  const double way = along * left + 0.5 * 5.0 / 7 * g * std::sin(0.1) * left * left;
  CHECK(std::abs(s.psi - (0.1 * std::sin(0.1) + way * std::cos(0.1))) <= 1e-8);
}

// Point feet (independent program, digits as printed in models/walker/README.md): two steps from the fixed point take
// twice 3.88194 s, and come back to it.
TEST_CASE("rigid contacts: a walker on points", "[events]") {
  Problem p = rigid_model("walker/point_feet.toml", 1e-12);
  const Simulation s = simulate(p, p.parameters.values());
  REQUIRE(s.events.size() == 2);
  CHECK(s.events[0].name == "contact.right: touch");
  CHECK(std::abs(s.events[0].t - 3.88194) <= 6e-6);
  CHECK(std::abs(s.events[1].t - 2 * s.events[0].t) <= 1e-6);
}

// In closed form (models/sliding_box/README.md): quadratic in time, to the tolerance of 1e-10, tenfold.
TEST_CASE("rigid contacts: a box slides to rest on both corners", "[events]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/sliding_box/sliding_box.toml"));
  const double by[] = {-0.3286665538215, -0.2618619915963, 0.2641208404324, 0, 0.0201927248037};
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-adjoint"},
                                            {"index1", "hand-adjoint"},
                                            {"index2", "discrete-adjoint"},
                                            {"index2", "idas-forward"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"penalty", "hand-tangent"},
                                            {"augmented-lagrangian", "cvodes-forward"},
                                            {"maggi", "cvodes-adjoint"},
                                            {"maggi", "cvodes-forward"},
                                            {"maggi-implicit", "idas-adjoint"},
                                            {"maggi-implicit", "discrete-tangent"}}) {
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, p.parameters.values());
    CAPTURE(formulation, method);
    CHECK(std::abs(r.psi - 0.198090630324291) <= 1e-9);
    REQUIRE(r.events.size() == 1);
    CHECK(std::abs(r.events[0].t - 0.2641208404323883) <= 1e-9);
    for (std::size_t j = 0; j < 5; ++j) CHECK(std::abs(r.gradient[j] - by[j]) <= 1e-9);
  }
}
