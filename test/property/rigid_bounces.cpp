// Impacts of rigid contacts with Coulomb friction: laws of restitution against closed forms and their energies,
// gradients through them against Richardson differences, and what has no solution.
#include <fmt/format.h>
#include <support/paths.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

namespace {

std::string rod(double turn, double speed, double mu, double restitution, const std::string& law,
                const std::string& parameters, const std::string& output) {
  return fmt::format(R"(
[gravity]
y_m_per_s2 = 0
[body.rod]
x_m = 0
y_m = {}
vx_m_per_s = {}
vy_m_per_s = -1
mass_kg = 1
inertia_kg_m2 = 0.333333333333333333
[point.tip]
on = "rod"
x_m = {}
y_m = {}
[contact.tip]
kind = "rigid"
point = "tip"
restitution = {}
{}
friction = "coulomb"
friction_coefficient = {}
[start]
given = ["rod.x", "rod.y", "rod.angle"]
[run]
t_end_s = 0.5
rtol = 1e-10
formulation = "index1"
method = "cvodes-adjoint"
parameters = [{}]
[[cost.terminal]]
kind = "value"
output = "{}"
)",
                     std::cos(turn) + 0.1, speed, std::sin(turn), -std::cos(turn), restitution, law, mu, parameters,
                     output);
}

/// One contact's impulses at speeds vn, vt: J M^-1 J^T = [nn nt; nt tt].
struct Impulse {
  double n, t;
};
struct OneContact {
  double nn, nt, tt, mu;
  double normal(double vn, Impulse p) const { return vn + nn * p.n + nt * p.t; }
  double along(double vt, Impulse p) const { return vt + nt * p.n + tt * p.t; }
  double taken(double vn, double vt, Impulse p) const {
    return -0.5 * (p.n * (vn + normal(vn, p)) + p.t * (vt + along(vt, p)));
  }
  /// With the normal speed `to` behind it, or with a given normal impulse.
  Impulse solve(double vn, double vt, double to, double given) const {
    const double det = nn * tt - nt * nt, a = to - vn;
    const Impulse sticks = given < 0 ? Impulse{(a * tt + vt * nt) / det, (-nn * vt - nt * a) / det}
                                     : Impulse{given, -(vt + nt * given) / tt};
    if (std::abs(sticks.t) <= mu * sticks.n) return sticks;
    for (const double s : {1.0, -1.0}) {
      const double n = given < 0 ? a / (nn - s * mu * nt) : given;
      if (n >= 0 && s * along(vt, {n, -s * mu * n}) >= 0) return {n, -s * mu * n};
    }
    return {NAN, NAN};
  }
};

std::string with_output(std::string text, const std::string& output) {
  return text.replace(text.find("OUTPUT"), 6, output);
}

}  // namespace

// A rod without gravity, so that the motion is straight but for the impact at 0.1 s; the angle at the end is w 0.4 s.
// Rates of rounding but for the tolerance of 1e-10. Where Newton's law would create energy it says so, and Poisson's
// takes some.
TEST_CASE("rigid bounces: what nothing presses bounces on, however slowly") {
  // Between walls 1 mm apart it goes on at 0.3 of its speed each time; by v0 alone the motion is scaled in time.
  double t = 0.0005 / 10, speed = 3, y = 0, direction = 1;
  for (; t + 0.001 / speed < 50; t += 0.001 / speed, speed *= 0.3, direction = -direction)
    y = direction > 0 ? 0.001 : 0;
  y += direction * speed * (50 - t);
  for (const char* formulation : {"index1", "baumgarte"}) {
    INFO(formulation);
    Problem p = problem_of_case("two_walls");
    p.formulation = formulation;
    const GradientResult r = gradient(p, "idas-adjoint", p.parameters.values());
    CHECK(r.psi == Approx(y).margin(1e-9));
    CHECK(r.gradient[0] == Approx(50 * direction * speed / -10).epsilon(1e-5));
    for (const std::string& text : take_notices()) CHECK(text.find("died out") == std::string::npos);
  }
}

TEST_CASE("rigid friction: a rod strikes, by Newton's law and by Poisson's", "[events]") {
  int refused = 0, stuck = 0, slid = 0;
  for (const double turn : {-0.685, 0.5})
    for (const double speed : {0.67, -0.3, 2.5})
      for (const double mu : {0.15, 0.6})
        for (const bool poisson : {false, true}) {
          const double e = 0.9, rx = std::sin(turn), ry = -std::cos(turn), I = 1.0 / 3;
          const OneContact c{1 + rx * rx / I, -rx * ry / I, 1 + ry * ry / I, mu};
          Impulse p = c.solve(-1, speed, poisson ? 0 : e, -1);
          double taken = c.taken(-1, speed, p), vt = c.along(speed, p);
          if (poisson) {
            const double vn = c.normal(-1, p);
            const Impulse x = c.solve(vn, vt, 0, e * p.n);
            taken += c.taken(vn, vt, x);
            vt = c.along(vt, x);
            p = {p.n + x.n, p.t + x.t};
          }
          const double w = (rx * p.n - ry * p.t) / I;
          Problem problem = make_problem(Scene::parse(
              rod(turn, speed, mu, e, poisson ? "restitution_law = \"poisson\"" : "", "", "rod.angle"), "rod.toml"));
          CAPTURE(turn, speed, mu, poisson, taken);
          if (taken < 0) {
            ++refused;
            CHECK_FALSE(poisson);
            CHECK_THROWS_WITH(simulate(problem, problem.parameters.values()),
                              Catch::Contains("contact.tip") && Catch::Contains("poisson"));
            continue;
          }
          const Simulation s = simulate(problem, problem.parameters.values());
          REQUIRE(s.events.size() == 1);
          CHECK(std::abs(s.events[0].t - 0.1) <= 1e-9);
          CHECK(std::abs(s.events[0].energy_lost - taken) <= 1e-9);
          CHECK(std::abs(s.psi - 0.4 * w) <= 1e-8);
          ++(std::abs(vt) < 1e-9 ? stuck : slid);
        }
  CHECK(refused >= 1);
  CHECK(stuck >= 2);
  CHECK(slid >= 2);
}

// Bounces are carried by every formulation. In one run the tip slides through the impact, in the other one it sticks;
// with Poisson's law the impulse that is given back depends on that of the compression. Against Richardson differences,
// whose own estimate is 1e-8.
TEST_CASE("rigid friction: gradients through bounces", "[events]") {
  const std::string parameters =
      R"("contact.tip.restitution", "contact.tip.friction_coefficient", "contact.tip.ground_angle_rad", "contact.tip.ground_height_m", "body.rod.mass_kg", "body.rod.inertia_kg_m2", "body.rod.vx_m_per_s", "point.tip.x_m", "point.tip.y_m")";
  for (const char* law :
       {"closing_speed_m_per_s = 0", "closing_speed_m_per_s = 0\nrestitution_law = \"poisson\""})  // for maggi
    for (const double mu : {0.15, 0.6}) {
      Problem p = make_problem(Scene::parse(rod(0.5, -0.3, mu, 0.6, law, parameters, "rod.x"), "rod.toml"));
      p.solver.rtol = 1e-11;
      const std::vector<double> rho = p.parameters.values();
      const GradientResult reference = gradient(p, "differences", rho);
      double size = 0;
      for (std::size_t j = 0; j < rho.size(); ++j)
        size = std::max(size, std::abs(reference.gradient[j] * p.parameters.parameters[j].scale));
      for (const auto& [formulation, method] :
           std::vector<std::pair<std::string, std::string>>{{"index1", "idas-adjoint"},
                                                            {"index1", "cvodes-forward"},
                                                            {"baumgarte", "cvodes-adjoint"},
                                                            {"index2", "idas-adjoint"},
                                                            {"index2", "idas-forward"},
                                                            {"penalty", "cvodes-adjoint"},
                                                            {"maggi", "cvodes-adjoint"},
                                                            {"maggi", "cvodes-forward"},
                                                            {"maggi-implicit", "idas-adjoint"}}) {
        p.formulation = formulation;
        const GradientResult r = gradient(p, method, rho);
        CAPTURE(law, mu, formulation, method);
        REQUIRE(r.events.size() == 1);
        for (std::size_t j = 0; j < rho.size(); ++j) {
          CAPTURE(p.parameters.parameters[j].name, r.gradient[j], reference.gradient[j]);
          CHECK(std::abs(r.gradient[j] - reference.gradient[j]) * p.parameters.parameters[j].scale <= 1e-6 * size);
        }
      }
    }
}

// The tip is ahead of the rod's centre and slides: its normal force would press it into the ground, 1/m + rx (rx + mu
// ry)/I < 0 (Painleve 1895). With little friction it goes on.
TEST_CASE("rigid friction: Painleve's rod", "[events]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/painleve_rod/painleve_rod.toml"));
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("contact.tip") && Catch::Contains("Painleve"));
  p = make_problem(Scene::load(COSTATE_MODELS_DIR "/painleve_rod/painleve_rod.toml",
                               {"contact.tip.friction_coefficient=0.2", "run.t_end_s=0.2"}));
  CHECK(simulate(p, p.parameters.values()).events.empty());
}

// A bar falls tilted onto both its ends, without friction and restitution: the ends strike in turn, each time 1/2 to
// 1/10 as fast, infinitely many times in finite time. Where they lift too little to be seen both stay closed, and carry
// half the weight each. The bar is level then but for the height of the last hop, some (3e-5 of the speed)^2/(2 g) =
// 1e-9 m.
TEST_CASE("rigid contacts: impacts that die out end in rest on both ends", "[events]") {
  const std::string scene = R"(
[gravity]
y_m_per_s2 = -9.81
[body.bar]
x_m = 0
y_m = 0.5
angle_rad = 0.2
mass_kg = 3
inertia_kg_m2 = 0.25
[point.left]
on = "bar"
x_m = -0.5
y_m = 0
[point.right]
on = "bar"
x_m = 0.5
y_m = 0
[contact.left]
kind = "rigid"
point = "left"
[contact.right]
kind = "rigid"
point = "right"
[start]
given = ["bar.x", "bar.y", "bar.angle"]
[run]
t_end_s = 1.5
rtol = 1e-10
[[cost.terminal]]
kind = "value"
output = "OUTPUT"
)";
  for (const char* formulation : {"index1", "baumgarte", "penalty"}) {
    CAPTURE(formulation);
    const auto end = [&](const std::string& output) {
      Problem p = make_problem(Scene::parse(with_output(scene, output), "bar.toml"));
      p.formulation = formulation;
      return simulate(p, p.parameters.values());
    };
    const Simulation s = end("left.normal_force");
    CHECK(s.events.back().mode == "closed");
    CHECK(s.events.size() < 30);
    CHECK(std::abs(s.psi - 0.5 * 3 * 9.81) <= 1e-5);
    CHECK(std::abs(end("bar.angle").psi) <= 1e-7);
    // All energy that it falls with is taken: 3 kg from 0.5 m.
    double taken = 0;
    for (const RunEvent& e : s.events) taken += e.energy_lost;
    CHECK(std::abs(taken - 3 * 9.81 * 0.5) <= 1e-6);
  }
}

// Both edges of the block stick in the end, which holds it twice along the ground; rows that do give. All energy above
// that of rest is taken; what gives leaves some 1e-8.
TEST_CASE("rigid contacts: a rocking block comes to rest", "[events]") {
  for (const char* formulation : {"penalty", "index1", "index2", "baumgarte"}) {
    CAPTURE(formulation);
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/rocking_block/rocking_block.toml", {"run.t_end_s=5"}));
    p.formulation = formulation;
    const Simulation s = simulate(p, p.parameters.values());
    CHECK(std::abs(s.psi) <= 1e-7);
    double taken = 0;
    for (const RunEvent& e : s.events) taken += e.energy_lost;
    CHECK(std::abs(taken - 9.81 * (0.623150273256 - 0.6)) <= 1e-6);
  }
}

// What sweeps the restitution comes to zero as well, where both laws are one: the ball falls, and stays.
TEST_CASE("rigid bounces: a law of restitution where there is none", "[events]") {
  for (const char* law : {"newton", "poisson"}) {
    const Problem p = make_problem(Scene::parse(fmt::format(R"(
gravity.y_m_per_s2 = -9.81
point.ball = {{ x_m = 0, y_m = 1 }}
mass.ball = {{ point = "ball", mass_kg = 1 }}
[contact.floor]
kind = "rigid"
point = "ball"
restitution = 0
restitution_law = "{}"
[start]
given = ["ball.x", "ball.y"]
[run]
t_end_s = 1
rtol = 1e-10
[[cost.running]]
kind = "value"
output = "ball.y"
)",
                                                            law),
                                                "ball.toml"));
    CAPTURE(law);
    // The integral of h - g t^2/2 until it lands.
    CHECK(simulate(p, p.parameters.values()).psi == Approx(2.0 / 3 * std::sqrt(2 / 9.81)).margin(1e-8));
  }
}

// The ball that strikes is tied by a spring to a block that slides: no impulse reaches that, and a cost of its friction
// misses none; by a rod one does.
TEST_CASE("rigid bounces: an impulse is missed by costs of reactions that it reaches, and no others", "[events]") {
  for (const bool rod : {false, true}) {
    CAPTURE(rod);
    const Problem p = make_problem(
        Scene::parse(fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81
[point.block]
x_m = 0
y_m = 0
vx_m_per_s = 1
[mass.block]
point = "block"
mass_kg = 2
[point.ball]
x_m = 1
y_m = 0.3
vx_m_per_s = 1
[mass.ball]
point = "ball"
mass_kg = 0.1
[{}
from = "block"
to = "ball"
[contact.block]
kind = "rigid"
point = "block"
closed = true
sliding = "forward"
friction = "coulomb"
friction_coefficient = 0.1
[contact.ball]
kind = "rigid"
point = "ball"
restitution = 0.5
[start]
given = ["block.x", "ball.x"{}]
given_velocities = ["block.x", "ball.x"{}]
[run]
t_end_s = 0.8
[[cost.running]]
kind = "square"
output = "block.friction_force"
)",
                                 rod ? "distance.link]" : "spring.link]\nstiffness_N_per_m = 5\nnatural_length_m = 1",
                                 rod ? "" : ", \"ball.y\"", rod ? "" : ", \"ball.y\""),
                     "tied.toml"));
    take_notices();
    const auto r = simulate(p, p.parameters.values());
    CHECK(std::any_of(r.events.begin(), r.events.end(),
                      [](const RunEvent& e) { return e.name == "contact.ball: touch"; }));
    const std::vector<std::string> said = take_notices();
    CHECK(rod == std::any_of(said.begin(), said.end(), [](const std::string& s) {
            return s.find("the integral of 'block.friction_force' in the cost, and its gradient, are without it") !=
                   std::string::npos;
          }));
  }
}
