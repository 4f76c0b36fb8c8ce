// Feet that touch only where they are ahead of another point: where they come ahead, or fall behind, within a step in
// which they reach the ground.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

constexpr double kHeight = 1, kGravity = 10, kRestitution = 0.5, kEnd = 0.6;
const double kTouch = std::sqrt(2 * kHeight / kGravity);

// P falls from 1 m; Q passes it along x at 1 m/s, in its direction or against it, `late` after P has reached the
// ground.
Problem falling(double way, double late, const std::string& law, double height = 2) {
  return make_problem(Scene::parse(fmt::format(R"(
gravity.y_m_per_s2 = -10
point.P = {{ x_m = 0, y_m = 1 }}
point.Q = {{ x_m = {:.17g}, y_m = {}, vx_m_per_s = {} }}
mass.P = {{ point = "P", mass_kg = 1 }}
mass.Q = {{ point = "Q", mass_kg = 1 }}
[contact.floor]
{}
point = "P"
ahead_of = "Q"
restitution = {}
[start]
given = ["P.x", "P.y", "Q.x", "Q.y"]
[run]
t_end_s = {}
parameters = ["point.P.y_m"]
[[cost.terminal]]
kind = "value"
output = "P.y"
)",
                                               -way * (kTouch + late), height, way, law, kRestitution, kEnd),
                                   "let_pass.toml"));
}

const char* kRigid = "kind = \"rigid\"\nclosing_speed_m_per_s = 0";
const char* kSoft = "law = \"flores\"\nstiffness_N_per_m_n = 1e7";

bool told(const std::vector<std::string>& said) {
  return std::any_of(said.begin(), said.end(), [](const std::string& s) {
    return s.find("'contact.floor: touch' comes to where it may be, or is not any more") != s.npos;
  });
}

}  // namespace

// In free fall steps are as long as the run: looks within them see P above the ground where it may touch, and then past
// the ground, or where it may not. y = h - g t^2/2 if it is let pass, else behind the impact at sqrt(2 h/g)
//   y = e g t_1 (t - t_1) - g (t - t_1)^2/2,  dy/dh = (e (t - 2 t_1) + t - t_1)/t_1.
TEST_CASE("let pass: of what comes ahead or falls behind as it reaches the ground the order decides", "[events]") {
  const double up = kEnd - kTouch, behind = kRestitution * kGravity * kTouch * up - 0.5 * kGravity * up * up,
               below = kHeight - 0.5 * kGravity * kEnd * kEnd,
               slope = (kRestitution * (kEnd - 2 * kTouch) + up) / kTouch;
  for (const double rtol : {1e-6, 1e-9})
    for (const auto& [formulation, integrator] : {std::pair{"index2", "idas"},
                                                  {"index2", "radau5"},
                                                  {"index1", "idas"},
                                                  {"baumgarte", "cvodes"},
                                                  {"baumgarte", "dop853"},
                                                  {"baumgarte", "dopri5"},
                                                  {"penalty", "radau9"},
                                                  {"maggi", "cvodes"},
                                                  {"maggi-implicit", "radau5"}})
      for (const double way : {1.0, -1.0})
        for (const double size : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5})
          for (const double late : {size, -size}) {
            Problem p = falling(way, late, kRigid);
            p.formulation = formulation;
            p.solver.rtol = rtol;
            p.solver.integrator = integrator;
            const bool touches = way * late > 0;  // ahead before Q has passed, or behind that
            CAPTURE(rtol, formulation, integrator, way, late);
            take_notices();
            const Simulation run = simulate(p, p.parameters.values());
            // Within 100 rtol of the gap, g t_1 `size` where Q passes, errors decide.
            CHECK(told(take_notices()) == (kGravity * kTouch * size < 100 * rtol * kHeight));
            CHECK(run.events.size() == (touches ? 1 : 0));
            CHECK(run.psi == Approx(touches ? behind : below).margin(100 * rtol));
          }
  for (const auto& [formulation, method] : {std::pair{"index2", "idas-adjoint"}, {"baumgarte", "cvodes-adjoint"}})
    for (const double late : {1e-4, -1e-4}) {
      Problem p = falling(1, late, kRigid);
      p.formulation = formulation;
      p.solver.rtol = 1e-9;
      CAPTURE(formulation, late);
      CHECK(gradient(p, method, p.parameters.values()).gradient[0] == Approx(late > 0 ? slope : 1).margin(1e-6));
    }
}

// The same on ground that gives, and by steps of a given length.
TEST_CASE("let pass: soft ground and fixed steps", "[events]") {
  for (const double way : {1.0, -1.0})
    for (const double size : {1e-1, 1e-2, 1e-3, 1e-4})
      for (const double late : {size, -size}) {
        CAPTURE(way, late);
        const bool touches = way * late > 0;
        for (const char* integrator : {"idas", "radau5"}) {
          Problem p = falling(way, late, kSoft);
          p.formulation = "index2";
          p.solver.integrator = integrator;
          p.solver.rtol = 1e-8;
          const Simulation run = simulate(p, p.parameters.values());
          CAPTURE(integrator);
          CHECK(run.events.size() == (touches ? 2 : 0));
          CHECK((run.psi > 0) == touches);
        }
        Problem p = falling(way, late, kRigid);
        p.formulation = "index3";
        p.solver.integrator = "fixed";
        p.solver.step_s = 0.05;
        const Simulation run = simulate(p, p.parameters.values());
        CHECK(run.events.size() == (touches ? 1 : 0));
      }
}

// As legs of one length pass each other both are at the ground: what comes there in that instant is let pass, and
// nothing is said of it. Where the other point is elsewhere the instant is chance, and told.
TEST_CASE("let pass: what comes to the ground in the instant in which it comes ahead", "[events]") {
  for (const auto& [formulation, integrator] :
       {std::pair{"index2", "idas"}, {"baumgarte", "cvodes"}, {"index2", "radau5"}})
    for (const double way : {1.0, -1.0})
      for (const double height : {1.0, 2.0}) {
        Problem p = falling(way, 0, kRigid, height);
        p.formulation = formulation;
        p.solver.rtol = 1e-9;
        p.solver.integrator = integrator;
        CAPTURE(formulation, integrator, way, height);
        take_notices();
        const Simulation run = simulate(p, p.parameters.values());
        if (height == kHeight) CHECK(run.events.empty());
        CHECK(told(take_notices()) == (height != kHeight));
      }
}

// Points that are thrown, of the plane and of space, over a slope; Q passes P from either side up to 0.1 s before it
// reaches the ground or behind that. With s along the slope and n normal to it all is a parabola: P touches where
// s_P > s_Q as n_P = 0. Before conditions were found within looks two runs in five were wrong here, in silence.
TEST_CASE("let pass: thrown points that pass each other near the ground, against their parabolas", "[events]") {
  std::mt19937 engine(11);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
  const auto sign = [&] { return engine() % 2 == 0 ? 1.0 : -1.0; };
  const std::pair<const char*, const char*> runs[] = {
      {"index2", "idas"},      {"index2", "radau5"},    {"index2", "radau9"}, {"baumgarte", "cvodes"},
      {"baumgarte", "dop853"}, {"baumgarte", "dopri5"}, {"index3", "radau3"}, {"maggi", "cvodes"},
      {"penalty", "idas"},     {"index3", "fixed"}};
  int scenes = 0;
  for (int attempt = 0; attempt < 150; ++attempt) {
    const bool space = engine() % 3 == 0, rigid = engine() % 2 == 0;
    const double angle = engine() % 2 == 0 ? 0 : uniform(-0.3, 0.3), c = std::cos(angle), s = std::sin(angle),
                 x = uniform(-1, 1), y = uniform(0.3, 2), vx = uniform(-3, 3), vy = uniform(-1, 3),
                 a = -0.5 * kGravity * c, b = c * vy - s * vx, above = c * y - s * x;
    if (above < 0.05) continue;
    const double touch = (-b - std::sqrt(b * b - 4 * a * above)) / (2 * a),
                 late = sign() * std::pow(10, uniform(-5, -1)), passes = touch + late,
                 wx = vx + sign() * uniform(0.3, 5), wy = uniform(-1, 1), qy = uniform(2, 3),
                 qx = x + (vx - wx) * passes + s / c * (y - qy + (vy - wy) * passes);
    if (passes < 0.01) continue;
    ++scenes;
    const bool touches = c * (x - qx + (vx - wx) * touch) + s * (y - qy + (vy - wy) * touch) > 0;
    const auto point = [&](const char* name, double px, double py, double ux, double uy) {
      const char* up = space ? "z" : "y";
      return fmt::format(
          "[point.{0}]\nx_m = {1:.17g}\n{3}_m = {2:.17g}\nvx_m_per_s = {4:.17g}\nv{3}_m_per_s = {5:.17g}\n{6}", name,
          px, py, up, ux, uy, space ? "y_m = 0\nvy_m_per_s = 0\n" : "");
    };
    const Scene scene = Scene::parse(
        fmt::format(
            "gravity.{}_m_per_s2 = -10\n{}{}[mass.P]\npoint = \"P\"\nmass_kg = 1\n"
            "[mass.Q]\npoint = \"Q\"\nmass_kg = 1\n[contact.floor]\n{}\npoint = \"P\"\nahead_of = \"Q\"\n"
            "restitution = 0.5\nground_angle_rad = {:.17g}\n[start]\ngiven = [{}]\n[run]\nt_end_s = {:.17g}\n",
            space ? "z" : "y", point("P", x, y, vx, vy), point("Q", qx, qy, wx, wy), rigid ? kRigid : kSoft, angle,
            space ? "\"P.x\", \"P.y\", \"P.z\", \"Q.x\", \"Q.y\", \"Q.z\"" : "\"P.x\", \"P.y\", \"Q.x\", \"Q.y\"",
            touch + uniform(0.02, 0.2)),
        "passes.toml");
    for (int k = 0; k < 3; ++k) {
      const auto& [formulation, integrator] = runs[engine() % std::size(runs)];
      Problem p = make_problem(scene);
      p.formulation = formulation;
      p.solver.integrator = integrator;
      p.solver.rtol = std::pow(10, -5.0 - 2 * static_cast<double>(engine() % 3));
      CAPTURE(attempt, formulation, integrator, p.solver.rtol, rigid, space, late);
      take_notices();
      const Simulation run = simulate(p, p.parameters.values());
      CHECK((run.events.empty() != touches || told(take_notices())));
    }
  }
  CHECK(scenes > 100);
}
