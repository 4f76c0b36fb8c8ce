// Rigid contacts of spheres in space with Coulomb friction, which slide, roll and bounce: against closed forms,
// integrals of the motion, and differences of whole motions.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/sliding_in_space.h"
#include "property/ways_compared.h"

using namespace costate;
using costate::test::check_ways;
using costate::test::event_names;
using costate::test::MethodWay;
using costate::test::SceneWords;
using costate::test::sliding_ball;

namespace {

// Where a slip that turns stops its direction turns ever faster, which tangents of IDAS at rtol 1e-11 do not follow;
// there the derivative of a Radau step of index 2 is singular, which is told.
const std::vector<MethodWay> sphere_ways = {{"index1", "idas-adjoint"},
                                            {"index1", "cvodes-adjoint"},
                                            {"index1", "cvodes-forward"},
                                            {"baumgarte", "idas-adjoint"},
                                            {"baumgarte", "cvodes-forward"},
                                            {"penalty", "cvodes-adjoint"},
                                            {"augmented-lagrangian", "cvodes-forward"},
                                            {"index2", "idas-adjoint"},
                                            {"index1", "hand-adjoint"},
                                            {"penalty-second-order", "hand-adjoint"},
                                            {"index2", "hand-adjoint"},
                                            {"index1", "discrete-tangent"},
                                            {"baumgarte", "discrete-adjoint"}};

// Of an integral, what errors of rtol a step sum up to over some hundreds of them.
constexpr double kKept = 5e-8;
// Of the largest component, what soft constraints cost here.
constexpr double kSoft = 1e-6;

using Words = SceneWords;
Problem make_ball(const Words& own) { return make_problem(Scene::parse(sliding_ball(own), "ball.toml")); }

const double kGravity = 9.81, kRadius = 0.1;

}  // namespace

// u = v - R w x n = (vx - R wy, vy + R wx) slides at mu g against itself and loses 7/2 of that, so that it rolls at t*
// = 2 |u|/(7 mu g) with v - 2/7 u; the spin about the vertical stays. All is quadratic in time but the turning.
TEST_CASE("spheres in space: a ball slides until it rolls", "[events]") {
  const double vx = 1.2, vy = -0.5, wx = 3, wy = -2, mu = 0.2, end = 1;
  const double ux = vx - kRadius * wy, uy = vy + kRadius * wx, u = std::hypot(ux, uy),
               stop = 2 * u / (7 * mu * kGravity);
  const auto place = [&](double v, double w) {
    return v * stop - 0.5 * mu * kGravity * w / u * stop * stop + (v - 2.0 / 7 * w) * (end - stop);
  };
  for (const MethodWay& way : sphere_ways) {
    Problem p = make_ball({});
    p.formulation = way.formulation;
    CAPTURE(way.formulation, way.method);
    const GradientResult r = gradient(p, way.method, p.parameters.values());
    REQUIRE(event_names(r.events) == std::vector<std::string>{"contact.floor: stop sticks"});
    CHECK(std::abs(r.events[0].t - stop) <= (std::string(way.formulation).starts_with("penalty") ? 1e-7 : 1e-8));
    std::vector<double> at;
    simulate(p, p.parameters.values(), {end}, [&](const MechanismState& s, System&) { at.assign(s.q, s.q + 2); });
    REQUIRE(at.size() == 2);
    CHECK(std::abs(at[0] - place(vx, ux)) <= 1e-8);
    CHECK(std::abs(at[1] - place(vy, uy)) <= 1e-8);
  }
}

TEST_CASE("spheres in space: gradients from sliding to rolling", "[events]") {
  check_ways(make_ball({{"YY", "0.007"}, {"ZZ", "0.0065"}}), {"contact.floor: stop sticks"}, sphere_ways, 2e-7, kSoft);
}

// It rolls at 5/7 g sin b down a slope of b along x, where friction serves: 2/7 tan b < mu.
TEST_CASE("spheres in space: a ball rolls down a slope", "[events]") {
  const double b = 0.3, end = 0.8, wx = 2, v = -kRadius * wx;  // across: vy = -R wx
  for (const MethodWay& way : sphere_ways) {
    Problem p = make_ball({{"ANGLE", "0.3"},
                           {"STATE", "closed = true"},
                           {"FRICTION", "0.3"},
                           {"WX", fmt::format("{:.17g}", wx * std::cos(b))},
                           {"WY", "0"},
                           {"WZ", fmt::format("{:.17g}", wx * std::sin(b))},
                           {"HEIGHT", fmt::format("{:.17g}", kRadius / std::cos(b))},
                           {"END", "0.8"},
                           {"GIVEN",
                            "given = [\"ball.x\", \"ball.y\", \"ball.orientation\"]\n"
                            "given_velocities = [\"ball.orientation\"]"},
                           {"PARAMETERS", "\"contact.floor.friction_coefficient\", \"rigid_body.ball.mass_kg\""}});
    p.formulation = way.formulation;
    CAPTURE(way.formulation, way.method);
    CHECK(gradient(p, way.method, p.parameters.values()).events.empty());
    std::vector<double> at;
    simulate(p, p.parameters.values(), {end}, [&](const MechanismState& s, System&) { at.assign(s.q, s.q + 2); });
    const double allowed = std::string(way.formulation).starts_with("penalty") ? 1e-7 : 1e-8;  // O(1/alpha)
    CHECK(std::abs(at[0] + 5.0 / 14 * kGravity * std::sin(b) * end * end * std::cos(b)) <= allowed);
    CHECK(std::abs(at[1] - v * end) <= allowed);
  }
}

// One whose centre is not that of its mass and whose moments differ rolls on, and its rows turn with it.
TEST_CASE("spheres in space: gradients of a loaded ball that rolls", "[events]") {
  const Problem p =
      make_ball({{"STATE", "closed = true"},
                 {"FRICTION", "2"},
                 {"YY", "0.005"},
                 {"ZZ", "0.004"},
                 {"OFF_X", "0.01"},
                 {"OFF_Z", "0.03"},
                 {"GIVEN",
                  "given = [\"ball.x\", \"ball.y\", \"ball.orientation\"]\n"
                  "given_velocities = [\"ball.orientation\"]"},
                 {"PARAMETERS",
                  "\"rigid_body.ball.mass_kg\", \"rigid_body.ball.inertia_yy_kg_m2\", "
                  "\"rigid_body.ball.omega_global_x_rad_per_s\", \"point.C.z_m\", "
                  "\"contact.floor.radius_m\", \"contact.floor.ground_angle_rad\", \"rigid_body.ball.x_m\""}});
  check_ways(p, {}, sphere_ways, 2e-7, kSoft);
}

// The instant of the end moves by the rate of the reactions, whose rows turn otherwise than their rates' derivatives
// say.
TEST_CASE("spheres in space: a loaded ball rolls until an acceleration is met", "[events]") {
  const Problem p = make_ball({{"STATE", "closed = true"},
                               {"FRICTION", "2"},
                               {"YY", "0.005"},
                               {"ZZ", "0.004"},
                               {"OFF_X", "0.01"},
                               {"OFF_Z", "0.03"},
                               {"END", "0.5\nends_when = { output = \"ball.x_ddot\", below = -0.1 }"},
                               {"GIVEN",
                                "given = [\"ball.x\", \"ball.y\", \"ball.orientation\"]\n"
                                "given_velocities = [\"ball.orientation\"]"},
                               {"PARAMETERS",
                                "\"rigid_body.ball.mass_kg\", \"rigid_body.ball.inertia_yy_kg_m2\", \"point.C.z_m\", "
                                "\"contact.floor.radius_m\", \"contact.floor.ground_angle_rad\""}});
  check_ways(p, {}, sphere_ways, kSoft, kSoft);
}

// Of what slides the friction's rows turn with the ball as well, which their rates' derivatives hold nothing of.
TEST_CASE("spheres in space: a loaded ball slides until an acceleration is met", "[events]") {
  const Problem p = make_ball({{"YY", "0.005"},
                               {"ZZ", "0.004"},
                               {"OFF_X", "0.01"},
                               {"OFF_Z", "0.03"},
                               {"END", "0.5\nends_when = { output = \"ball.z_ddot\", above = 0.1 }"},
                               {"PARAMETERS",
                                "\"rigid_body.ball.mass_kg\", \"rigid_body.ball.inertia_yy_kg_m2\", \"point.C.z_m\", "
                                "\"contact.floor.friction_coefficient\", \"rigid_body.ball.vx_m_per_s\""}});
  check_ways(p, {}, sphere_ways, kSoft, kSoft);
}

// What falls with u at the ground loses mu (1 + e) V of it, 7/2 of that counted, or all of it: v - 2/7 u. Garwin's ball
// has no restitution along the ground.
TEST_CASE("spheres in space: a ball that spins bounces", "[events]") {
  const double h = 0.5, V = std::sqrt(2 * kGravity * h), e = 0.6, t = V / kGravity, end = 0.6;
  const double vx = 1.2, vy = -0.5, wx = 3, wy = -2;
  const double ux = vx - kRadius * wy, uy = vy + kRadius * wx, u = std::hypot(ux, uy);
  for (const double mu : {0.05, 0.3})
    for (const MethodWay& way : sphere_ways) {
      Problem p = make_ball({{"HEIGHT", "0.6"},
                             {"STATE", "restitution = 0.6\nclosing_speed_m_per_s = 0"},
                             {"FRICTION", fmt::format("{}", mu)},
                             {"END", "0.6"},
                             {"GIVEN", "given = [\"ball\"]"}});
      p.formulation = way.formulation;
      CAPTURE(mu, way.formulation, way.method);
      const GradientResult r = gradient(p, way.method, p.parameters.values());
      REQUIRE(event_names(r.events) == std::vector<std::string>{"contact.floor: touch bounces"});
      const double lost = std::min(mu * (1 + e) * V, 2.0 / 7 * u);
      std::vector<double> at;
      simulate(p, p.parameters.values(), {end}, [&](const MechanismState& s, System&) { at.assign(s.q, s.q + 3); });
      const double left = end - t;
      CHECK(std::abs(at[0] - (vx * end - lost * ux / u * left)) <= 1e-8);
      CHECK(std::abs(at[1] - (vy * end - lost * uy / u * left)) <= 1e-8);
      CHECK(std::abs(at[2] - (kRadius + e * V * left - 0.5 * kGravity * left * left)) <= 1e-8);
    }
}

TEST_CASE("spheres in space: gradients through a bounce that slides or sticks", "[events]") {
  for (const char* law : {"newton", "poisson"})
    for (const char* mu : {"0.05", "0.3"})
      check_ways(make_ball({{"HEIGHT", "0.6"},
                            {"STATE", fmt::format("restitution = 0.6\nclosing_speed_m_per_s = 0\n"
                                                  "restitution_law = \"{}\"",
                                                  law)},
                            {"FRICTION", mu},
                            {"YY", "0.007"},
                            {"ZZ", "0.0065"},
                            {"OFF_X", "0.005"},
                            {"END", "0.6"},
                            {"GIVEN", "given = [\"ball\"]"}}),
                 {"contact.floor: touch bounces"}, sphere_ways, 2e-7, kSoft);
}

// From above it lands, slides and rolls, with gradients through all of it.
TEST_CASE("spheres in space: a ball lands, slides and rolls", "[events]") {
  check_ways(make_ball({{"HEIGHT", "0.3"}, {"STATE", ""}, {"FRICTION", "0.1"}, {"GIVEN", "given = [\"ball\"]"}}),
             {"contact.floor: touch slides", "contact.floor: stop sticks"}, sphere_ways, 2e-7, kSoft);
}

// L.rho with rho from the centre of mass to the touch stays whatever the ground's force, in impacts as well, of what is
// round about the line to the sphere's centre (Jellett): L' = rho x F, and L.rho' = L.(w x A c), three vectors of one
// plane. By the formulation's own errors, 1e-9 of it, ten times.
TEST_CASE("spheres in space: what is round about an axis keeps Jellett's integral", "[events]") {
  for (const char* formulation : {"index1", "baumgarte", "augmented-lagrangian"}) {
    Problem p = make_ball({{"HEIGHT", "0.2"},
                           {"STATE", ""},
                           {"FRICTION", "0.3"},
                           {"YY", "0.006"},
                           {"ZZ", "0.004"},
                           {"OFF_Z", "0.02"},
                           {"WZ", "40"},
                           {"END", "2"},
                           {"GIVEN", "given = [\"ball\"]"}});
    p.formulation = formulation;
    std::vector<double> kept;
    simulate(p, p.parameters.values(), {0.0, 0.1, 0.5, 1.0, 1.5, 2.0}, [&](const MechanismState& s, System&) {
      const double *q = s.q + 3, *d = s.v + 3;
      // w = 2 G e' in the body's frame, c and n there as well.
      const double w[3] = {2 * (-q[1] * d[0] + q[0] * d[1] + q[3] * d[2] - q[2] * d[3]),
                           2 * (-q[2] * d[0] - q[3] * d[1] + q[0] * d[2] + q[1] * d[3]),
                           2 * (-q[3] * d[0] + q[2] * d[1] - q[1] * d[2] + q[0] * d[3])};
      const double n[3] = {2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]),
                           q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]};
      const double L[3] = {0.006 * w[0], 0.006 * w[1], 0.004 * w[2]};
      kept.push_back(-kRadius * (L[0] * n[0] + L[1] * n[1] + L[2] * n[2]) + 0.02 * L[2]);
    });
    CAPTURE(formulation);
    REQUIRE(kept.size() == 6);
    for (const double x : kept) CHECK(std::abs(x - kept.front()) <= kKept * std::abs(kept.front()));
  }
}

TEST_CASE("spheres in space: refusals", "[events]") {
  CHECK_THROWS_WITH(make_ball({{"STATE", "closed = true\nalong_m = 0.2"}}), Catch::Contains("holds no place"));
  const Problem p = make_ball({{"STATE", "closed = true"},
                               {"GIVEN", "equilibrium = true"},
                               {"PARAMETERS", "\"contact.floor.friction_coefficient\""}});
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("rows of velocities alone"));
}
