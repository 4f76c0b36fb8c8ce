// Latches: events that hold and let go; and the walker with knees that has them.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;

namespace {

// A disc turns freely until its angle comes to zero, where a latch holds it.
std::string caught(const std::string& more = "") {
  return R"([body.disc]
x_m = 0
y_m = 0
angle_rad = -0.6
angular_velocity_rad_per_s = 1.5
mass_kg = 1
inertia_kg_m2 = 0.2

[latch.catch]
angle = "disc"
closes = "from_below"
stiffness_N_m_per_rad = 40
damping_N_m_s_per_rad = 0.8
)" + more +
         R"(
[start]
given = ["disc.x", "disc.y", "disc.angle"]

[[cost.terminal]]
kind = "value"
output = "disc.angle"

[run]
t_end_s = 1
)";
}

/// Behind the catch at -x0/w: w/wd exp(-d s) sin(wd s).
double by_hand(double x0, double w, double k, double c) {
  const double J = 0.2, d = c / (2 * J), wd = std::sqrt(k / J - d * d), s = 1 + x0 / w;
  return w / wd * std::exp(-d * s) * std::sin(wd * s);
}

}  // namespace

TEST_CASE("latch: a disc is caught, in closed form, with its gradient", "[events]") {
  Problem p = make_problem(Scene::parse(caught(), "latch.toml"),
                           {"body.disc.angle_rad", "body.disc.angular_velocity_rad_per_s",
                            "latch.catch.stiffness_N_m_per_rad", "latch.catch.damping_N_m_s_per_rad"});
  p.solver.rtol = p.solver.atol = 1e-10;
  const auto rho = p.parameters.values();
  const auto psi = [](const std::vector<double>& r) { return by_hand(r[0], r[1], r[2], r[3]); };
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "idas-adjoint"},
                                            {"index1", "cvodes-forward"},
                                            {"index3", "idas-adjoint"},
                                            {"maggi", "cvodes-adjoint"}}) {
    CAPTURE(formulation, method);
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, rho);
    CHECK(std::abs(r.psi - psi(rho)) < 5e-9);  // some tens of the tolerance
    for (std::size_t j = 0; j < rho.size(); ++j) {
      auto more = rho, less = rho;
      const double h = 1e-5 * std::abs(rho[j]);  // the formula's own derivative, to 1e-9
      more[j] += h;
      less[j] -= h;
      const double expected = (psi(more) - psi(less)) / (2 * h);
      CHECK(std::abs(r.gradient[j] - expected) < 1e-7 * std::max(0.05, std::abs(expected)));
    }
  }
}

TEST_CASE("latch: what cannot be is refused by name") {
  const auto refused = [](const std::string& more) {
    return [=] { return make_problem(Scene::parse(caught(more), "latch.toml")); };
  };
  CHECK_THROWS_WITH(refused("release_point = \"foot\"\n")(), Contains("latch.catch.release_point"));
  CHECK_THROWS_WITH(refused("stifness = 3\n")(), Contains("stifness"));
}

// Their order is two: with (rate h)^2 of some 1e-4 the derivative is within 1e-3, and one of the steps' own.
TEST_CASE("latch: caught by fixed steps", "[events]") {
  Problem p = make_problem(Scene::parse(caught(), "latch.toml"), {"latch.catch.stiffness_N_m_per_rad"});
  const std::vector<double> rho = p.parameters.values();
  const double right = gradient(p, "cvodes-forward", rho).gradient[0];
  p.formulation = "index3";
  p.solver.step_s = 1e-3;
  const double back = gradient(p, "discrete-adjoint", rho).gradient[0];
  CHECK(back == Approx(right).epsilon(1e-3));
  CHECK(back == Approx(gradient(p, "discrete-tangent", rho).gradient[0]).epsilon(1e-10));
}

// The gait that `costate cycle` finds (rtol 1e-9) has steps of 0.543835312 s; the scene starts within it, so that heel
// strikes are as far apart. Not far from rigid ground: 0.5425895 s (models/walker/rigid_knees.py, a program apart).
TEST_CASE("knees: a steady gait", "[walker]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/walker/knees.toml"), {});
  p.solver.rtol = 1e-9;
  p.solver.t_end = 2.2;
  p.formulation = "baumgarte";
  const auto run = simulate(p, p.parameters.values());
  std::vector<double> strikes;
  int caught = 0, released = 0;
  for (const auto& e : run.events) {
    if (e.name.find("touch") != std::string::npos) strikes.push_back(e.t);
    if (e.name.find("catch") != std::string::npos) ++caught;
    if (e.name.find("latch") != std::string::npos && e.mode == "free") ++released;
  }
  REQUIRE(strikes.size() == 4);
  CHECK(caught == 4);
  CHECK(released == 4);
  for (std::size_t k = 1; k < strikes.size(); ++k)
    CHECK(strikes[k] - strikes[k - 1] == Approx(0.543835312).epsilon(1e-6));
}

// Over a heel strike, at which two events happen at once, and a knee that is caught, to 1e-6 at rtol 1e-10.
TEST_CASE("knees: gradients through touch, catch and release", "[walker]") {
  Problem p =
      make_problem(Scene::load(COSTATE_MODELS_DIR "/walker/knees.toml"), {"slope", "thigh_mass", "shank_center"});
  p.solver.rtol = 1e-10;
  p.solver.t_end = 0.9;
  const auto rho = p.parameters.values();
  p.formulation = "index1";
  const GradientResult reference = gradient(p, "differences", rho);
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "idas-adjoint"},
                                            {"index1", "cvodes-adjoint"},
                                            {"index1", "idas-forward"},
                                            {"maggi", "cvodes-adjoint"}}) {
    CAPTURE(formulation, method);
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, rho);
    for (std::size_t j = 0; j < rho.size(); ++j)
      CHECK(std::abs(r.gradient[j] - reference.gradient[j]) * rho[j] < 1e-6 * std::abs(reference.gradient[0] * rho[0]));
  }
}
