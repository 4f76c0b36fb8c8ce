// What is well posed and was refused, or failed: by a look outside of the motion, or by the rounding of a conversion.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "property/sliding_in_space.h"
#include "support/paths.h"

using namespace costate;
using Catch::Detail::Approx;

namespace {
Problem case_of(const std::string& name, const std::vector<std::string>& overrides = {}) {
  return make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, name), overrides));
}
double psi_of(const Problem& p) {
  const double psi = simulate(p, p.parameters.values()).psi;
  take_notices();
  return psi;
}
}  // namespace

TEST_CASE("needless refusals: a road by data is refused where the wheel leaves the data, not where looks do") {
  // As the same data that hold beyond their ends.
  CHECK(psi_of(case_of("road_by_data")) == Approx(4.98034).epsilon(1e-6));
}

TEST_CASE("needless refusals: a break before another negative one is a parameter like any other") {
  const Problem p = case_of("negative_breaks", {R"(run.parameters=["spring.s.spring_law.breaks[0]"])"});
  for (const std::string method : {"idas-forward", "idas-adjoint", "hand-adjoint"}) {
    INFO(method);
    // By differences of psi.
    CHECK(gradient(p, method, p.parameters.values()).gradient[0] == Approx(0.5821954).epsilon(1e-6));
  }
  take_notices();
}

TEST_CASE("needless refusals: sample times that differ by rounding are one") {
  for (const std::string name : {"samples_in_ms", "samples_in_two_units"}) {
    const Problem p = case_of(name);
    const GradientResult right = gradient(p, "idas-forward", p.parameters.values());
    for (const std::string method : {"idas-adjoint", "cvodes-adjoint", "cvodes-forward"}) {
      INFO(name << " by " << method);
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(r.psi == Approx(right.psi).epsilon(1e-6));
      for (std::size_t j = 0; j < right.gradient.size(); ++j)
        CHECK(r.gradient[j] == Approx(right.gradient[j]).epsilon(1e-5));
    }
    take_notices();
  }
}

TEST_CASE("needless refusals: a patch may begin on some of its points") {
  // As three contacts that share their numbers, of which one begins on the ground.
  const std::string shared =
      "stiffness_N_per_m_n = 1e5\nrestitution = 0.3\nfriction = \"coulomb\"\nfriction_coefficient = 0.5\n";
  const Scene scene = Scene::load(fmt::format("{}/test/cases/patch_on_its_heel.toml", COSTATE_SOURCE_DIR));
  std::string apart = scene.dump();
  const std::size_t begin = apart.find("[contact.c]"), end = apart.find("\n[", begin);
  apart.erase(begin, end - begin);
  for (const char* name : {"P1", "P2", "P3"})
    apart += fmt::format("\n[contact.{0}]\npoint = \"{0}\"\n{1}{2}", name, shared,
                         std::string(name) == "P1" ? "approach_speed_m_per_s = 0.1\n" : "");
  const auto first = apart.find("\"contact.c.approach");
  apart.replace(first, apart.find(']', first) - first, "\"contact.P1.approach_speed_m_per_s\", \"friction\"");
  apart +=
      "\n[parameter.friction]\nnumbers = [\"contact.P1.friction_coefficient\", \"contact.P2.friction_coefficient\", "
      "\"contact.P3.friction_coefficient\"]\n";
  const Problem patch = make_problem(scene), three = make_problem(Scene::parse(apart, "apart.toml"));
  const GradientResult right = gradient(three, "idas-forward", three.parameters.values());
  for (const std::string method : {"idas-forward", "idas-adjoint", "cvodes-adjoint"}) {
    INFO(method);
    const GradientResult r = gradient(patch, method, patch.parameters.values());
    CHECK(r.psi == Approx(right.psi).epsilon(1e-6));
    for (std::size_t j = 0; j < right.gradient.size(); ++j)
      CHECK(r.gradient[j] == Approx(right.gradient[j]).epsilon(1e-5).margin(1e-7));
  }
  take_notices();
}

// A mass on a point of a body was refused in the plane, so that explain --plane could not write what it had found. It
// is as good as a body of the sum of both: masses 1 kg and 2 kg at 0 and (0.6, 0.3) have their centre at (0.4, 0.2),
// and about it 0.1 + 1 (0.4^2 + 0.2^2) + 2 (0.2^2 + 0.1^2) = 0.4 kg m^2.
TEST_CASE("needless refusals: a mass sits on a body of the plane") {
  const auto problem = [](const std::string& body, const std::string& more) {
    Problem p =
        make_problem(Scene::parse("[gravity]\nx_m_per_s2 = 1\ny_m_per_s2 = -9.81\n[body.b]\nx_m = 0\ny_m = 0\n"
                                  "angle_rad = 0.4\nangular_velocity_rad_per_s = 2\n" +
                                      body + R"([point.O]
ground = true
x_m = 0
y_m = 0
[point.C]
on = "b"
x_m = 0
y_m = 0
[point.Q]
on = "b"
x_m = 0.6
y_m = 0.3
[revolute.r]
points = ["O", "C"]
[start]
given = ["b.angle"]
[[cost.terminal]]
kind = "value"
output = "Q.y"
[[cost.running]]
kind = "square"
output = "r.reaction_x"
weight = 1e-3
[run]
t_end_s = 1
rtol = 1e-10
)" + more,
                                  "s.toml"));
    p.formulation = "baumgarte";
    return p;
  };
  const Problem one = problem("mass_kg = 3\ninertia_kg_m2 = 0.4\ncenter_x_m = 0.4\ncenter_y_m = 0.2\n", "");
  const Problem two = problem("mass_kg = 1\ninertia_kg_m2 = 0.1\n",
                              "parameters = [\"m\", \"x\", \"g\"]\n[mass.m]\npoint = \"Q\"\nmass_kg = 2\n"
                              "[parameter.m]\nnumber = \"mass.m.mass_kg\"\n[parameter.x]\nnumber = \"point.Q.x_m\"\n"
                              "[parameter.g]\nnumber = \"gravity.y_m_per_s2\"\n");
  const auto rho = two.parameters.values();
  CHECK(simulate(two, rho).psi == Approx(simulate(one, {}).psi).epsilon(1e-8));
  const GradientResult right = gradient(two, "differences", rho);
  for (const char* method : {"idas-adjoint", "cvodes-forward", "hand-adjoint"}) {
    INFO(method);
    const GradientResult r = gradient(two, method, rho);
    for (std::size_t j = 0; j < rho.size(); ++j) CHECK(r.gradient[j] == Approx(right.gradient[j]).epsilon(1e-6));
  }
  take_notices();
}

// Towards the stop friction turns as fast as the slip is slow: Newton's iteration of the step that ends there did not
// converge, and the run failed.
TEST_CASE("needless refusals: a slip in space stops by Radau's schemes") {
  Problem p = make_problem(Scene::parse(costate::test::pulled_block({{"RTOL", "1e-9"}}), "slip.toml"));
  p.solver.confirm = false;
  p.formulation = "index1";
  p.solver.integrator = "cvodes";
  const double psi = psi_of(p);
  p.formulation = "index2";
  for (const auto& [scheme, rtol] : {std::pair{"radau9", 1e-9}, {"radau9", 1e-7}, {"radau5", 1e-5}, {"radau5", 1e-9}}) {
    CAPTURE(scheme, rtol);
    p.solver.integrator = scheme;
    p.solver.set_rtol(rtol);
    const Simulation run = simulate(p, p.parameters.values());
    CHECK(run.events.size() == 2);  // it slips, and it stops
    CHECK(std::abs(run.psi - psi) <= 2e3 * rtol * std::abs(psi));
    take_notices();
  }
}

// All refused, or took 5.8e-1 of it for the gradient's error: "which of them comes first decides". The third foot
// sticks, and about it the body can but turn, so that the other two stop together for every parameter.
TEST_CASE("needless refusals: feet of a body that turns about a third one stop together") {
  Problem p = make_problem(Scene::load(COSTATE_SOURCE_DIR "/test/cases/tripod.toml"));
  p.solver.confirm = false;
  p.solver.integrator.clear();
  // Differences of runs at two steps and five formulations, which agree to six digits.
  const double psi = 0.75754576, expected[] = {-0.546984, 0.4690210, 1.317231};
  for (const auto& [formulation, method] : {std::pair{"index1", "cvodes-forward"},
                                            {"index2", "idas-adjoint"},
                                            {"maggi", "cvodes-forward"},
                                            {"index3", "hand-tangent"}}) {
    CAPTURE(formulation, method);
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(r.psi == Approx(psi).epsilon(1e-6));
    for (std::size_t j = 0; j < 3; ++j) CHECK(r.gradient[j] == Approx(expected[j]).epsilon(1e-5));
  }
  take_notices();
}
