// Contacts that impacts of others lift too little to be followed stay closed: what slides all the time is slowed by
// mu (m g t + the change of m y'), however often and in whichever order its ends strike, so that
//   x(t) = x0 + v t - mu (y(t) - y0 - y0' t + g t^2/2).
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {
constexpr double kSpeed = 5, kFriction = 0.2, kHeight = 0.5, kFeet = 0.1, kEnd = 2.5, kGravity = 9.81;

/// A bar that falls on its feet, slanting, as it slides.
Problem sliding_bar(double inertia, double restitution, const std::string& law, bool space) {
  const auto contact = [&](const std::string& name, double x) {
    return fmt::format(R"(
[point.{0}]
on = "bar"
x_m = {1}
{2}
[contact.{0}]
kind = "rigid"
point = "{0}"
restitution = {3}
restitution_law = "{4}"
friction = "coulomb"
friction_coefficient = {5}
)",
                       name, x, fmt::format("{} = {}", space ? "y_m = 0\nz_m" : "y_m", -kFeet), restitution, law,
                       kFriction);
  };
  const std::string body = space ? fmt::format(R"(
[gravity]
z_m_per_s2 = {}
[rigid_body.bar]
mass_kg = 3
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = {}
inertia_zz_kg_m2 = 1
x_m = 0
y_m = 0
z_m = {}
rotation_axis = [0, 1, 0]
angle_rad = -0.2
vx_m_per_s = {}
)",
                                               -kGravity, inertia, kHeight, kSpeed)
                                 : fmt::format(R"(
[gravity]
y_m_per_s2 = {}
[body.bar]
x_m = 0
y_m = {}
angle_rad = 0.2
vx_m_per_s = {}
mass_kg = 3
inertia_kg_m2 = {}
)",
                                               -kGravity, kHeight, kSpeed, inertia);
  return make_problem(
      Scene::parse(body + contact("left", -0.5) + contact("right", 0.5) +
                       fmt::format(R"(
[parameter.mu]
numbers = ["contact.left.friction_coefficient", "contact.right.friction_coefficient"]
[start]
given = ["bar.x", {}]
[run]
t_end_s = {}
rtol = 1e-10
parameters = ["mu"]
[[cost.terminal]]
kind = "value"
output = "bar.x"
)",
                                   space ? R"("bar.y", "bar.z", "bar.orientation")" : R"("bar.y", "bar.angle")", kEnd),
                   "bar.toml"));
}

constexpr double kSlowed = kFeet - kHeight + 0.5 * kGravity * kEnd * kEnd;
// Of tolerances of 1e-10, over some fifty events.
constexpr double kOfPsi = 5e-9, kOfGradient = 1e-7;

void check_bar(Problem p, const char* formulation, const char* method) {
  CAPTURE(formulation, method);
  p.formulation = formulation;
  const GradientResult r = gradient(p, method, p.parameters.values());
  CHECK(std::abs(r.psi - (kSpeed * kEnd - kFriction * kSlowed)) < kOfPsi);
  CHECK(std::abs(r.gradient[0] + kSlowed) < kOfGradient);
  int held = 0;
  for (const std::string& text : take_notices())
    if (text.find("too little to be seen: it stays closed") != std::string::npos) {
      ++held;
      CHECK(text.find("would lift contact.left and") == std::string::npos);
      CHECK(text.find("That takes -") == std::string::npos);
    }
  CHECK(held > 0);
}
}  // namespace

TEST_CASE("hardly lifted: friction of a bar that slides as its ends strike in turn", "[events]") {
  for (const double inertia : {0.9, 1.2}) {
    CAPTURE(inertia);
    check_bar(sliding_bar(inertia, 0, "newton", false), "index1", "cvodes-adjoint");
    check_bar(sliding_bar(inertia, 0, "newton", false), "baumgarte", "cvodes-forward");
    check_bar(sliding_bar(inertia, 0, "newton", false), "penalty", "discrete-adjoint");
  }
}

TEST_CASE("hardly lifted: as both ends bounce, by Newton's law and by Poisson's", "[events]") {
  for (const char* law : {"newton", "poisson"}) {
    CAPTURE(law);
    check_bar(sliding_bar(1.2, 0.5, law, false), "baumgarte", "cvodes-adjoint");
    check_bar(sliding_bar(1.2, 0.2, law, false), "index1", "cvodes-forward");
  }
}

TEST_CASE("hardly lifted: a bar that slides in space", "[events]") {
  check_bar(sliding_bar(1.2, 0, "newton", true), "baumgarte", "cvodes-forward");
  check_bar(sliding_bar(0.9, 0, "newton", true), "baumgarte", "discrete-adjoint");
}
