// Contacts of bodies that have nothing to do with each other take no part in each other's events: what strikes in one
// instant has a gradient then, and how many rest at a time does not matter.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

std::string ball(const std::string& name, double x, const std::string& contact) {
  return fmt::format(R"(
[point.{0}]
x_m = {1}
y_m = 0.3
[mass.{0}]
point = "{0}"
mass_kg = 1
[contact.{0}]
point = "{0}"
{2}
)",
                     name, x, contact);
}

Problem make(const std::string& text, const std::string& formulation) {
  Problem p = make_problem(Scene::parse(text, "independent.toml"));
  p.formulation = formulation;
  return p;
}

GradientResult gradient_of(const std::string& text, const std::string& formulation, const std::string& method) {
  const Problem p = make(text, formulation);
  return gradient(p, method, p.parameters.values());
}

const char* const kTwoBalls = R"(
[start]
given = ["A.x", "A.y", "B.x", "B.y"]
[parameter.height]
numbers = ["point.A.y_m", "point.B.y_m"]
[parameter.e]
number = "contact.A.restitution"
[[cost.terminal]]
kind = "value"
output = "A.y"
weight = 2
[[cost.terminal]]
kind = "value"
output = "B.y"
[gravity]
y_m_per_s2 = -10
[run]
t_end_s = 0.4
rtol = 1e-9
parameters = ["height", "e"]
)";

}  // namespace

// y(T) = e g t (T - t) - g/2 (T - t)^2 with t = sqrt(2 h/g), dt/dh = 1/(g t).
TEST_CASE("independent contacts: a gradient through balls that strike in one instant", "[events]") {
  const std::string text = ball("A", 0, "kind = \"rigid\"\nrestitution = 0.8\nclosing_speed_m_per_s = 0") +
                           ball("B", 1, "kind = \"rigid\"\nrestitution = 0.5\nclosing_speed_m_per_s = 0") + kTwoBalls;
  constexpr double g = 10, h = 0.3, T = 0.4;
  const double t = std::sqrt(2 * h / g);
  const auto by_height = [&](double e) { return (e * g * (T - 2 * t) + g * (T - t)) / (g * t); };
  const double of_height = 2 * by_height(0.8) + by_height(0.5), of_e = 2 * g * t * (T - t);
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "idas-adjoint"},
                                            {"index1", "cvodes-forward"},
                                            {"index2", "idas-adjoint"},
                                            {"maggi", "cvodes-adjoint"},
                                            {"baumgarte", "discrete-adjoint"},
                                            {"penalty", "idas-forward"}}) {
    INFO(formulation << ", " << method);
    take_notices();
    const GradientResult r = gradient_of(text, formulation, method);
    // Quadratic motions of order one: errors are the tolerance's, some hundred times.
    CHECK(r.gradient[0] == Approx(of_height).epsilon(1e-7));
    CHECK(r.gradient[1] == Approx(of_e).epsilon(1e-7));
    REQUIRE(r.events.size() == 2);
    for (const std::string& notice : take_notices()) CHECK(notice.find("one instant") == std::string::npos);
  }
}

// A damper between them: the one that strikes first slows the other down.
TEST_CASE("independent contacts: what is linked is not independent", "[events]") {
  const std::string damper = R"(
[spring.link]
from = "A"
to = "B"
stiffness_N_per_m = 0
natural_length_m = 1
damping_N_s_per_m = 1
)";
  const std::string a = ball("A", 0, "kind = \"rigid\"\nrestitution = 0.8\nclosing_speed_m_per_s = 0");
  CHECK_THROWS_WITH(gradient_of(a + ball("B", 1, "kind = \"rigid\"\nrestitution = 0.5\nclosing_speed_m_per_s = 0") +
                                    damper + kTwoBalls,
                                "baumgarte", "idas-adjoint"),
                    Catch::Contains("strike at the same time"));
  take_notices();
  gradient_of(a + ball("B", 1, "law = \"flores\"\nstiffness_N_per_m_n = 1e4\nrestitution = 0.5") + damper + kTwoBalls,
              "baumgarte", "idas-adjoint");
  bool told = false;
  for (const std::string& notice : take_notices()) told = told || notice.find("one instant") != std::string::npos;
  CHECK(told);
}

// Each open or closed: 2^18 ways if they were gone through together.
TEST_CASE("independent contacts: eighteen points come to rest", "[events]") {
  std::string text, given;
  for (int i = 0; i < 18; ++i) {
    const std::string name = fmt::format("P{}", i);
    text += ball(name, i, "kind = \"rigid\"\nrestitution = 0");
    given += fmt::format("{}\"{}.x\", \"{}.y\"", i == 0 ? "" : ", ", name, name);
  }
  text += fmt::format(R"(
[gravity]
y_m_per_s2 = -9.81
[start]
given = [{}]
[[cost.terminal]]
kind = "value"
output = "P7.y"
[run]
t_end_s = 1
)",
                      given);
  const Problem p = make(text, "baumgarte");
  const Simulation run = simulate(p, p.parameters.values());
  REQUIRE(run.events.size() == 18);
  for (const RunEvent& event : run.events) {
    CHECK(event.t == Approx(std::sqrt(2 * 0.3 / 9.81)).epsilon(1e-9));
    CHECK(event.mode == "closed");
  }
}
