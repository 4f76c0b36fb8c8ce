// Passive walkers on ground that gives: they walk, and their gradients through every touch are right.
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <string>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {

Problem walker(const std::string& scene, const std::vector<std::string>& parameters) {
  return make_problem(Scene::load(COSTATE_MODELS_DIR "/walker/" + scene), parameters);
}

/// The largest difference of derivatives times parameters, relative to the largest of these.
double distance(const std::vector<double>& rho, const GradientResult& a, const GradientResult& b) {
  double size = 0, off = 0;
  for (std::size_t j = 0; j < rho.size(); ++j) {
    if (!std::isfinite(a.gradient[j])) return HUGE_VAL;
    size = std::max(size, std::abs(b.gradient[j] * rho[j]));
    off = std::max(off, std::abs((a.gradient[j] - b.gradient[j]) * rho[j]));
  }
  return off / size;
}

}  // namespace

// Ten steps of the walker on arcs. Against differences of whole runs at rtol 1e-11 (their own estimate: 1e-8 of the
// largest), methods agree to some 1e4 rtol, as touches do elsewhere (contact_events.cpp).
TEST_CASE("walker: gradients over ten steps", "[walker]") {
  Problem p = walker("arc_feet.toml", {"slope", "leg_center", "friction", "stiffness"});
  const std::vector<double> rho = p.parameters.values();
  p.formulation = "baumgarte";
  p.solver.rtol = 1e-10;
  const GradientResult reference = gradient(p, "differences", rho);
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "idas-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"baumgarte", "cvodes-forward"},
                                            {"index1", "idas-adjoint"},
                                            {"index2", "idas-adjoint"},
                                            {"index3", "idas-forward"},
                                            {"maggi", "cvodes-adjoint"},
                                            {"penalty", "cvodes-adjoint"},
                                            {"augmented-lagrangian", "cvodes-adjoint"},
                                            {"penalty-second-order", "cvodes-forward"},
                                            {"maggi-implicit", "idas-adjoint"}}) {
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, rho);
    CAPTURE(formulation, method);
    CHECK(r.counters.jumps == 19);
    CHECK(std::abs(r.psi - reference.psi) <= 1e-6 * std::abs(reference.psi));
    CHECK(distance(rho, r, reference) <= 1e-5);
  }
}

// At rtol 1e-12 methods of both integrators and the hand-derived equations agree to some 1e5 rtol, each with an error
// beside it that holds.
TEST_CASE("walker: gradients over ten steps, between methods", "[walker]") {
  Problem p = walker("arc_feet.toml", {"slope", "leg_center", "friction", "stiffness"});
  const std::vector<double> rho = p.parameters.values();
  p.solver.confirm = false;
  p.solver.rtol = 1e-12;
  p.formulation = "baumgarte";
  const GradientResult first = gradient(p, "idas-forward", rho);
  for (const auto& [formulation, method] : {std::pair{"index2", "idas-adjoint"},
                                            {"index3", "idas-adjoint"},
                                            {"baumgarte", "idas-adjoint"},
                                            {"penalty", "idas-adjoint"},
                                            {"maggi-implicit", "idas-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"penalty", "cvodes-adjoint"},
                                            {"augmented-lagrangian", "cvodes-adjoint"},
                                            {"maggi", "cvodes-adjoint"},
                                            {"maggi-second-order", "cvodes-adjoint"},
                                            {"index1", "cvodes-forward"},
                                            {"baumgarte", "cvodes-forward"}}) {
    p.formulation = formulation;
    CAPTURE(formulation, method);
    CHECK(distance(rho, gradient(p, method, rho), first) <= 1e-6);
  }
  // The second-order adjoint holds derivatives of forces by time, which at touches are some 1e3 times these.
  for (const auto& [formulation, most] : {std::pair{"index1", 1e-6},
                                          {"index2", 1e-6},
                                          {"baumgarte", 1e-6},
                                          {"penalty", 1e-6},
                                          {"penalty-second-order", 1e-4},
                                          {"maggi-implicit", 1e-6}}) {
    p.formulation = formulation;
    CAPTURE(formulation);
    CHECK(distance(rho, gradient(p, "hand-adjoint", rho), first) <= most);
  }
}

// The gait settles: ten steps later, steps are 2.4356 s long to 1e-4. On rigid ground, where impacts are plastic, the
// same walker takes 2.4279558 s (models/walker/rigid_gait.py, a program apart): the share by which ground that gives,
// creeps and gives back a twentieth of the speed differs is below one in a hundred.
TEST_CASE("walker: a steady gait near that on rigid ground", "[walker]") {
  Problem p = walker("arc_feet.toml", {"slope"});
  p.solver.t_end = 48;
  const auto r = simulate(p, p.parameters.values());
  std::vector<double> touches;
  for (const auto& e : r.events)
    if (e.name.find("touch") != std::string::npos) touches.push_back(e.t);
  REQUIRE(touches.size() > 18);
  const double last = touches.back() - touches[touches.size() - 2];
  const double before = touches[touches.size() - 2] - touches[touches.size() - 3];
  CHECK(std::abs(last - before) <= 1e-4);
  CHECK(std::abs(last / 2.4279558 - 1) <= 0.01);
}

// On flat soles, five points each, and in space on spheres, with a roll: methods of different kinds agree.
TEST_CASE("walker: surface contact and space", "[walker]") {
  struct Case {
    const char* scene;
    double t_end;
    int events;
  };
  for (const Case& c : {Case{"sole_feet.toml", 6, 20}, Case{"space.toml", 6, 6}}) {
    Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/walker/" + std::string(c.scene)));
    p.solver.t_end = c.t_end;
    p.solver.rtol = 1e-9;
    const std::vector<double> rho = p.parameters.values();
    p.formulation = "baumgarte";
    const GradientResult reference = gradient(p, "cvodes-forward", rho);
    CAPTURE(c.scene);
    CHECK(reference.counters.jumps >= c.events);
    for (const auto& [formulation, method] :
         {std::pair{"baumgarte", "idas-adjoint"}, {"maggi", "cvodes-adjoint"}, {"index1", "idas-forward"}}) {
      p.formulation = formulation;
      const GradientResult r = gradient(p, method, rho);
      CAPTURE(formulation, method);
      CHECK(std::abs(r.psi - reference.psi) <= 1e-6 * std::abs(reference.psi));
      CHECK(distance(rho, r, reference) <= 1e-4);
    }
  }
}

// A foot that swings through touches only where it is ahead: the walker without that stumbles at once.
TEST_CASE("walker: straight legs pass each other only where a foot is let pass", "[walker]") {
  std::ifstream file(COSTATE_MODELS_DIR "/walker/arc_feet.toml");
  std::string text, blind;
  for (std::string line; std::getline(file, line);) {
    text += line + "\n";
    if (line.find("ahead_of = ") != 0) blind += line + "\n";
  }
  REQUIRE(blind.size() < text.size());
  for (const bool let_pass : {true, false}) {
    const Problem p = make_problem(Scene::parse(let_pass ? text : blind, "walker.toml"), {"slope"});
    const double ahead = -simulate(p, p.parameters.values()).psi;
    CAPTURE(let_pass, ahead);
    CHECK((ahead > 4) == let_pass);
  }
}

// Started a million times slower it falls over backwards. At 2.38 s the right foot reaches the ground 2 ms before it
// falls behind the other one, within one step of Radau's schemes: they let it pass (psi 0.80).
TEST_CASE("walker: a foot that reaches the ground within the step in which it falls behind", "[walker]") {
  const Scene scene = Scene::load(
      COSTATE_MODELS_DIR "/walker/arc_feet.toml",
      {"body.left.vx_m_per_s=4.7822453e-8", "body.left.vy_m_per_s=-4.78240e-10",
       "body.left.angular_velocity_rad_per_s=-2.39124223e-7", "body.right.angular_velocity_rad_per_s=-1.85432519e-7"});
  Problem p = make_problem(scene, {"slope"});
  for (const auto& [formulation, integrator] : {std::pair{"index2", "radau5"},
                                                {"index2", "radau9"},
                                                {"maggi-implicit", "radau9"},
                                                {"penalty", "idas"},
                                                {"baumgarte", "cvodes"}}) {
    p.formulation = formulation;
    p.solver.integrator = integrator;
    p.solver.rtol = 1e-8;
    CAPTURE(formulation, integrator);
    // By all of them at 1e-10 and 1e-12: 4.3077108; the motion makes some 500 rtol of errors.
    CHECK(simulate(p, p.parameters.values()).psi == Approx(4.3077108).epsilon(5e-6));
  }
}

// Behind a touch the first steps are as short as the rounding of their estimates, which the bound of rates on forces
// that bend took for errors: steps of 1e-10 s for good.
TEST_CASE("walker: Radau's steps grow behind a touch at tight tolerances", "[walker]") {
  Problem p = walker("soft_points.toml", {});
  p.formulation = "index2";
  for (const double rtol : {1e-10, 1e-12})
    for (const auto& [integrator, most] : {std::pair{"radau5", 16'000L}, {"radau9", 2'500L}}) {
      p.solver.integrator = integrator;
      p.solver.rtol = rtol;
      CAPTURE(integrator, rtol);
      const Simulation run = simulate(p, p.parameters.values());
      CHECK(run.psi == Approx(0.5752773868).epsilon(1e-8));  // radau9 at 1e-12: 0.575277386839
      CHECK(run.counters.steps < most);                      // 7,957 and 1,073 at rtol 1e-12
    }
}
