// Bounces die out, infinitely many in finite time, and are not seen to their end: integrals of reactions are off by
// what the ground gives over the rest of them, and say so.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/accurate_run.h"

using namespace costate;

namespace {

Problem dropped(const std::vector<std::string>& overrides = {}) {
  return make_problem(Scene::parse(R"toml(
[gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 1
vx_m_per_s = 2
[mass.m]
point = "P"
mass_kg = 1
[contact.f]
kind = "rigid"
point = "P"
restitution = 0.5
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 2
rtol = 1e-9
parameters = ["e"]
[[cost.running]]
kind = "value"
output = "f.normal_force"
[parameter.e]
number = "contact.f.restitution"
)toml",
                                   "dropped.toml", overrides));
}

}  // namespace

// The mass rests from t1 (1 + e)/(1 - e) on, t1 = sqrt(2 h/g), and m g is what it weighs from there: closed form of psi
// and of its derivative by e.
TEST_CASE("rigid bounces: integrals of reactions say what unseen bounces leave out", "[events]") {
  const Problem p = dropped();
  const double g = 9.81, e = 0.5, T = 2, t1 = std::sqrt(2 / g), psi = g * (T - t1 * (1 + e) / (1 - e)),
               by_e = -g * t1 * 2 / ((1 - e) * (1 - e));
  // The last bounces' speeds are known to some percent.
  const Simulation s = simulate(p, p.parameters.values());
  REQUIRE(s.known_error);
  CHECK(std::abs(s.psi - psi) > 1e-5);  // or there is nothing to say
  CHECK(std::abs(s.psi - psi) <= 1.05 * s.known_error->psi);
  CHECK(s.known_error->psi <= 10 * std::abs(s.psi - psi));
  for (const char* method : {"idas-adjoint", "cvodes-forward", "hand-adjoint", "discrete-tangent"}) {
    CAPTURE(method);
    const GradientResult r = gradient(p, method, p.parameters.values());
    REQUIRE(r.known_error);
    CHECK(std::abs(r.psi - psi) <= 1.05 * r.known_error->psi);
    CHECK(std::abs(r.gradient[0] - by_e) <= r.known_error->gradient[0]);
    CHECK(r.known_error->gradient[0] <= 0.01 * std::abs(by_e));
  }
  AccuracyRequest request;
  request.accuracy = 1e-8;
  const AccurateRun run = run_to_accuracy(p, p.parameters.values(), request);
  CHECK(!run.met);
  CHECK(std::abs(run.result.psi - psi) <= 1.05 * run.psi_error);
  take_notices();
}

// How small a hop is not seen is a part of the coordinates, or of the mechanism's length where these are smaller: at
// the origin of x they are all zero as the mass strikes, and its bounces died out later than a metre on.
TEST_CASE("rigid bounces: where along the ground they are makes no difference", "[events]") {
  std::vector<double> psi;
  for (const char* place : {"0", "0.3", "0.9"}) {
    const Problem p = dropped({"point.P.vx_m_per_s=0", std::string("point.P.x_m=") + place});
    psi.push_back(simulate(p, p.parameters.values()).psi);
  }
  CHECK(std::abs(psi[1] - psi[0]) <= 1e-9 * psi[0]);
  CHECK(std::abs(psi[2] - psi[0]) <= 1e-9 * psi[0]);
  take_notices();
}
