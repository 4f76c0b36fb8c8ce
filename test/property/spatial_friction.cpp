// Rigid contacts in space with Coulomb friction that turns with the slip; against closed forms, an independent program,
// the plane's scene, and differences of whole motions.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/sliding_in_space.h"
#include "support/with_words.h"

using namespace costate;
using costate::test::with_words;

namespace {

struct SpatialWay {
  const char *formulation, *method;
};
const std::vector<SpatialWay> spatial_ways = {{"index1", "idas-adjoint"},
                                              {"index1", "idas-forward"},
                                              {"index1", "cvodes-adjoint"},
                                              {"index1", "cvodes-forward"},
                                              {"baumgarte", "idas-adjoint"},
                                              {"baumgarte", "idas-forward"},
                                              {"baumgarte", "cvodes-adjoint"},
                                              {"baumgarte", "cvodes-forward"},
                                              {"penalty", "idas-forward"},
                                              {"penalty", "cvodes-adjoint"},
                                              {"augmented-lagrangian", "cvodes-forward"},
                                              {"index2", "idas-adjoint"},
                                              {"index2", "idas-forward"},
                                              {"index3", "idas-adjoint"},
                                              {"index1", "hand-tangent"},
                                              {"index1", "hand-adjoint"},
                                              {"baumgarte", "hand-adjoint"},
                                              {"index2", "hand-tangent"},
                                              {"index2", "hand-adjoint"},
                                              {"penalty", "hand-adjoint"},
                                              {"penalty-second-order", "hand-adjoint"},
                                              {"augmented-lagrangian", "hand-tangent"},
                                              {"index1", "discrete-tangent"},
                                              {"baumgarte", "discrete-adjoint"},
                                              {"index2", "discrete-tangent"},
                                              {"index2", "discrete-adjoint"},
                                              {"maggi", "cvodes-adjoint"},
                                              {"maggi", "cvodes-forward"},
                                              {"maggi", "hand-adjoint"},
                                              {"maggi", "discrete-tangent"},
                                              {"maggi-implicit", "idas-adjoint"},
                                              {"maggi-implicit", "idas-forward"},
                                              {"maggi-implicit", "hand-tangent"},
                                              {"maggi-implicit", "hand-adjoint"},
                                              {"maggi-implicit", "discrete-adjoint"},
                                              {"maggi-second-order", "cvodes-adjoint"},
                                              {"maggi-second-order", "hand-tangent"},
                                              {"maggi-second-order", "hand-adjoint"}};

std::vector<std::string> names_of(const GradientResult& r) {
  std::vector<std::string> names;
  for (const RunEvent& e : r.events) names.push_back(e.name + " " + e.mode);
  return names;
}

const char* thrown = R"(
[gravity]
z_m_per_s2 = -9.81
[point.block]
x_m = 0
y_m = 0
z_m = 0
vx_m_per_s = VX
vy_m_per_s = VY
[mass.block]
point = "block"
mass_kg = 2
[contact.slope]
kind = "rigid"
point = "block"
closed = true
sliding = "forward"
ground_angle_rad = ANGLE
friction = "coulomb"
friction_coefficient = 0.5
[start]
given = ["block.x", "block.y"]
[run]
t_end_s = END
rtol = 1e-11
formulation = "index1"
parameters = ["contact.slope.friction_coefficient", "mass.block.mass_kg", "contact.slope.ground_angle_rad", "point.block.vx_m_per_s", "gravity.z_m_per_s2"]
[[cost.terminal]]
kind = "value"
output = "block.x"
)";

Problem throw_block(double vx, double vy, double angle, double end) {
  return make_problem(Scene::parse(with_words(thrown, {{"VX", fmt::format("{:.17g}", vx)},
                                                       {"VY", fmt::format("{:.17g}", vy)},
                                                       {"ANGLE", fmt::format("{}", angle)},
                                                       {"END", fmt::format("{}", end)}}),
                                   "thrown.toml"));
}

/// By all ways against the differences of whole motions, to `tolerance` of the largest scaled component.
void check_spatial_gradients(Problem p, const std::vector<std::string>& events, double tolerance) {
  const std::vector<double> rho = p.parameters.values();
  const GradientResult reference = gradient(p, "differences", rho);
  CHECK(names_of(reference) == events);
  double size = 0;
  for (std::size_t j = 0; j < rho.size(); ++j)
    size = std::max(size, std::abs(reference.gradient[j] * p.parameters.parameters[j].scale));
  for (const SpatialWay& way : spatial_ways) {
    p.formulation = way.formulation;
    const GradientResult r = gradient(p, way.method, rho);
    CAPTURE(way.formulation, way.method);
    CHECK(names_of(r) == events);
    for (std::size_t j = 0; j < rho.size(); ++j) {
      CAPTURE(p.parameters.parameters[j].name, r.gradient[j], reference.gradient[j]);
      CHECK(std::abs(r.gradient[j] - reference.gradient[j]) * p.parameters.parameters[j].scale <= tolerance * size);
    }
  }
}

}  // namespace

// Obliquely up a slope, with u along it and w across: u' = -g sin b - mu g cos b u/|v|, w' = -mu g cos b w/|v|. By
// scipy:
//   f = lambda t, y: (n := np.hypot(y[2], y[3])) and [y[2], y[3], -g*s - mu*g*c*y[2]/n, -mu*g*c*y[3]/n]
//   solve_ivp(f, [0, 0.3], [0, 0, 1/c, 2], method="DOP853", rtol=1e-13, atol=1e-15)
// with g, b, mu = 9.81, 0.3, 0.5; x = c y[0]. It stops where the speed is 0, extrapolated from 1e-7 m/s; what counts as
// rest, 5e-10 m/s, is 3e-10 s before at a deceleration of g (mu cos b - sin b) = 1.8 m/s^2. Runs at rtol 1e-11 have
// places to some 1e-11, and of penalty to 1e-10 by 1/alpha, taken tenfold.
TEST_CASE("rigid friction in space: a block thrown obliquely up a slope", "[events]") {
  for (const SpatialWay& way : spatial_ways) {
    Problem p = throw_block(1, 2, 0.3, 0.3);
    p.formulation = way.formulation;
    CAPTURE(way.formulation, way.method);
    GradientResult r = gradient(p, way.method, p.parameters.values());
    CHECK(r.events.empty());
    CHECK(std::abs(r.psi - 0.11104746728881694) <= 1e-9);
    p = throw_block(1, 2, 0.3, 0.8);
    p.formulation = way.formulation;
    r = gradient(p, way.method, p.parameters.values());
    REQUIRE(names_of(r) == std::vector<std::string>{"contact.slope: stop sticks"});
    CHECK(std::abs(r.events[0].t - 0.556558068454481) <= 2e-9);
    CHECK(std::abs(r.psi - 0.07393371954776863) <= 1e-9);
  }
}

// Differences' own estimate is 1e-11; penalty is off by 2e-9.
TEST_CASE("rigid friction in space: gradients of a slip that turns", "[events]") {
  check_spatial_gradients(throw_block(1, 2, 0.3, 0.3), {}, 1e-8);
}

TEST_CASE("rigid friction in space: gradients through a stop", "[events]") {
  check_spatial_gradients(throw_block(1, 2, 0.3, 0.8), {"contact.slope: stop sticks"}, 1e-8);
}

// Up and down again: the direction turns round, and with it what Maggi's reactions are in terms of.
TEST_CASE("rigid friction in space: gradients of a slip that turns round", "[events]") {
  check_spatial_gradients(throw_block(1, 2, 0.7, 0.8), {}, 1e-8);
}

// The instant of the end moves by the rate of what is met, in which the direction turns.
TEST_CASE("rigid friction in space: a run that ends by an acceleration while a slip turns", "[events]") {
  const Problem p = make_problem(
      Scene::parse(with_words(thrown, {{"VX", "1"},
                                       {"VY", "2"},
                                       {"ANGLE", "0.3"},
                                       {"END", "0.5\nends_when = { output = \"block.y_ddot\", above = -4.1 }"}}),
                   "thrown.toml"));
  check_spatial_gradients(p, {}, 1e-8);
}

// On level ground the way is v^2/(2 mu g) in whatever direction, by mu -v^2/(2 mu^2 g): turned with the start alone.
TEST_CASE("rigid friction in space: no direction of the ground is another one", "[events]") {
  const double way = 4 / (2 * 0.5 * 9.81);
  for (const double angle : {0.0, 0.7, 2.5, -1.2}) {
    const double c = std::cos(angle);
    const Problem p = throw_block(2 * c, 2 * std::sin(angle), 0, 0.8);
    for (const char* method : {"idas-adjoint", "cvodes-forward"}) {
      const GradientResult r = gradient(p, method, p.parameters.values());
      CAPTURE(angle, method);
      REQUIRE(names_of(r) == std::vector<std::string>{"contact.slope: stop sticks"});
      CHECK(std::abs(r.psi - way * c) <= 1e-9);
      CHECK(std::abs(r.gradient[0] + 2 * way * c) <= 1e-8);
    }
  }
}

namespace {

Problem pulled_along(const std::string& puller, const std::string& nail, const std::string& along, bool space) {
  costate::test::SceneWords words{{"PULLER", puller}, {"NAIL", nail}, {"ALONG", along}};
  if (!space) {
    words.emplace_back("UP", "y");
    words.emplace_back("GIVEN", R"("puller.x", "puller.y")");
    words.emplace_back("Z_BLOCK", "");
  }
  return make_problem(Scene::parse(costate::test::pulled_block(words), "pulled.toml"));
}

const std::vector<std::string> pulled_events = {"contact.floor: slip slides", "contact.floor: stop sticks"};

}  // namespace

// Where all moves in a plane space has what the plane has, along x and, turned, along y. Sliding begins with an offset
// of 1e-9 m/s and ends 5e-10 m/s early, along a line without consequence; tolerances are those of rtol 1e-11, tenfold.
TEST_CASE("rigid friction in space: what moves in a plane as in the plane", "[events]") {
  const Problem plane = pulled_along("x_m = 0.9\ny_m = 0.3\nvx_m_per_s = 1.5", "x_m = 0.8\ny_m = 2", "x", false);
  const GradientResult expected = gradient(plane, "cvodes-forward", plane.parameters.values());
  REQUIRE(names_of(expected) == pulled_events);
  const Problem along_x =
      pulled_along("x_m = 0.9\ny_m = 0\nz_m = 0.3\nvx_m_per_s = 1.5", "x_m = 0.8\ny_m = 0\nz_m = 2", "x", true);
  const Problem along_y =
      pulled_along("x_m = 0\ny_m = 0.9\nz_m = 0.3\nvy_m_per_s = 1.5", "x_m = 0\ny_m = 0.8\nz_m = 2", "y", true);
  for (const Problem& p : {along_x, along_y})
    for (const char* method : {"idas-forward", "cvodes-forward"}) {
      const GradientResult r = gradient(p, method, p.parameters.values());
      CAPTURE(method);
      REQUIRE(names_of(r) == pulled_events);
      for (std::size_t k = 0; k < 2; ++k) CHECK(std::abs(r.events[k].t - expected.events[k].t) <= 1e-9);
      CHECK(std::abs(r.psi - expected.psi) <= 1e-10);
      for (std::size_t j = 0; j < r.gradient.size(); ++j) {
        CAPTURE(p.parameters.parameters[j].name);
        CHECK(std::abs(r.gradient[j] - expected.gradient[j]) <= 1e-8);
      }
    }
}

// The stop of a slip is met from its own side at every tolerance. Beyond it friction is the other way round, and the
// derivative of a cost that jumps there (0.3412 for 0.3491 by mass, at most tolerances from 1e-6 to 1e-10, with 2.5
// times the steps) was of that other motion. What is left are the runs' own errors, of some 1e3 rtol.
TEST_CASE("rigid friction in space: a slip stops before it turns round", "[events]") {
  const Problem plane = pulled_along("x_m = 0.9\ny_m = 0.3\nvx_m_per_s = 1.5", "x_m = 0.8\ny_m = 2", "x", false);
  const GradientResult expected = gradient(plane, "cvodes-forward", plane.parameters.values());
  Problem p = pulled_along("x_m = 0.9\ny_m = 0\nz_m = 0.3\nvx_m_per_s = 1.5", "x_m = 0.8\ny_m = 0\nz_m = 2", "x", true);
  p.solver.confirm = false;
  for (const char* method : {"idas-forward", "cvodes-forward"})
    for (const double rtol : {1e-6, 3e-7, 1e-7, 3e-8, 1e-8, 3e-9, 1e-9, 3e-10, 1e-10}) {
      p.solver.rtol = rtol;
      CAPTURE(method, rtol);
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(names_of(r) == pulled_events);
      for (std::size_t j = 0; j < r.gradient.size(); ++j)
        CHECK(std::abs(r.gradient[j] - expected.gradient[j]) <= 1e3 * rtol + 1e-7);
    }
}

// A pull that turns: sliding begins along the friction that sticking takes, and turns at once. Differences' own
// estimate is 1e-10. Of the other methods see slips_from_rest.cpp.
TEST_CASE("rigid friction in space: gradients through a slip that begins and turns", "[events]") {
  Problem p = pulled_along("x_m = 0.9\ny_m = 0\nz_m = 0.3\nvx_m_per_s = 1.5\nvy_m_per_s = 0.7",
                           "x_m = 0.8\ny_m = 0\nz_m = 2", "x", true);
  const std::vector<double> rho = p.parameters.values();
  const GradientResult reference = gradient(p, "differences", rho);
  CHECK(names_of(reference) == pulled_events);
  for (const SpatialWay& way : std::vector<SpatialWay>{{"index1", "idas-forward"},
                                                       {"index1", "cvodes-forward"},
                                                       {"baumgarte", "idas-forward"},
                                                       {"baumgarte", "cvodes-forward"},
                                                       {"maggi", "cvodes-forward"},
                                                       {"maggi-implicit", "idas-forward"}}) {
    p.formulation = way.formulation;
    const GradientResult r = gradient(p, way.method, rho);
    CAPTURE(way.formulation, way.method);
    CHECK(names_of(r) == pulled_events);
    for (std::size_t j = 0; j < rho.size(); ++j) {
      CAPTURE(p.parameters.parameters[j].name, r.gradient[j], reference.gradient[j]);
      CHECK(std::abs(r.gradient[j] - reference.gradient[j]) <= 1e-8);
    }
  }
}

// What is not carried is refused by name.
TEST_CASE("rigid friction in space: refusals", "[events]") {
  const Problem p = throw_block(0, 0, 0.3, 0.3);
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("along its velocity"));
}
