// Kinematic sweeps against closed forms, to where the mechanism locks.
#include "costate/analysis/sweep.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/stop.h"
#include "scene_texts.h"

using namespace costate;
using namespace costate::test;
using Catch::Matchers::Contains;

namespace {

/// A crank of 0.5 m at the origin and a rod of 1.2 m to a slider on the x axis, which a spring pulls to the
/// left.
const std::string slider_crank = R"(
[gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.3
y_m = 0.4
[point.R]
x_m = 1.45
y_m = 0
[point.wall]
ground = true
x_m = -1
y_m = 0
[bar.crank]
from = "O"
to = "P"
mass_kg = 2
length_m = 0.5
[bar.rod]
from = "P"
to = "R"
mass_kg = 0
length_m = 1.2
[angle.crank]
bar = "crank"
[driver.guide]
coordinate = "R.y"
law = { kind = "polynomial", coefficients = [0] }
[spring.S]
from = "wall"
to = "R"
stiffness_N_per_m = 30
natural_length_m = 1.5
[mass.slider]
point = "R"
mass_kg = 1
[start]
given = ["crank.angle"]
)";

struct Case {
  explicit Case(const std::string& text) : scene(Scene::parse(text, "s.toml")), assembly(scene.mechanism(), {}) {}
  Scene scene;
  Assembly assembly;
  Sweep sweep(const std::string& coordinate, double from, double to, int count, bool hold = true) {
    return sweep_position(assembly, 0, hold ? held_by_start(assembly) : std::vector<HeldPosition>{},
                          scene.mechanism()->coordinate(coordinate), from, to, count);
  }
  double of(const SweepPoint& p, const std::string& name) { return p.at.q[scene.mechanism()->coordinate(name)]; }
};

}  // namespace

TEST_CASE("sweep: a crank goes round twice", "[sweep]") {
  Case c(slider_crank);
  const Sweep s = c.sweep("crank.angle", 0, 12.5, 41);
  REQUIRE(s.points.size() == 41);
  CHECK(s.stopped.empty());
  for (std::size_t k = 0; k < s.points.size(); ++k) {
    const SweepPoint& p = s.points[k];
    CHECK(p.value == Approx(12.5 * static_cast<double>(k) / 40).margin(1e-12));
    const double a = 0.5, l = 1.2, phi = p.value, root = std::sqrt(l * l - a * a * std::sin(phi) * std::sin(phi));
    const double x = a * std::cos(phi) + root;
    CHECK(c.of(p, "crank.angle") == Approx(phi).margin(1e-12));
    CHECK(c.of(p, "R.x") == Approx(x).epsilon(1e-12));
    CHECK(c.of(p, "P.y") == Approx(a * std::sin(phi)).margin(1e-12));
    // Virtual work: what holds the crank does the work that spring and weight take up.
    const double x_phi = -a * std::sin(phi) - a * a * std::sin(phi) * std::cos(phi) / root;
    const double moment = 30 * (x + 1 - 1.5) * x_phi + 2 * 9.81 * a / 2 * std::cos(phi);
    CHECK(-p.at.held[0] == Approx(moment).margin(1e-10 * 30));
  }
}

TEST_CASE("sweep: can be stopped between its positions", "[sweep]") {
  Case c(slider_crank);
  struct Stopped {};
  static int calls;
  calls = 0;
  set_stop_check(+[] {
    if (++calls > 50) throw Stopped();
  });
  CHECK_THROWS_AS(c.sweep("crank.angle", 0, 12.5, 100000), Stopped);
  set_stop_check(nullptr);
}

TEST_CASE("sweep: the slider locks at its dead centre, and what was computed stays", "[sweep]") {
  Case c(slider_crank);
  const Sweep s = c.sweep("R.x", 1.2, 1.8, 13, false);
  // 1.2, 1.25, ... 1.65, and 1.7 = 0.5 + 1.2, where the crank lies along the rod, if rounding lets it.
  CHECK(s.points.size() >= 10);
  CHECK(s.points.size() <= 11);
  CHECK(s.reached <= 1.7 + 1e-9);
  CHECK(s.reached > 1.69);
  CHECK_THAT(s.stopped, Contains("locks") && Contains("'R.x'") && Contains("1.7"));
  for (const SweepPoint& p : s.points) {
    // On the branch of the first guess: the crank above the axis.
    CHECK(c.of(p, "P.y") > -1e-6);
    CHECK(c.of(p, "R.x") == Approx(p.value).epsilon(1e-12));
  }
}

TEST_CASE("sweep: freedom that is left is balanced", "[sweep]") {
  // The slider's guide is let go: spring and weight place it.
  const std::string text = replaced(replaced(slider_crank, "coordinate = \"R.y\"", "coordinate = \"P.x\""),
                                    "coefficients = [0]", "coefficients = [0.3]");
  Case c(text);
  const auto held = std::vector<HeldPosition>{};
  const Sweep s = sweep_position(c.assembly, 0, held, c.scene.mechanism()->coordinate("R.x"), 1.3, 1.1, 5);
  REQUIRE(s.points.size() == 5);
  for (const SweepPoint& p : s.points) {
    CHECK(p.at.degrees_of_freedom == 0);  // the crank is held by the driver, the rod by R.x
    CHECK(std::hypot(c.of(p, "P.x") - p.value, c.of(p, "P.y") - c.of(p, "R.y")) == Approx(1.2).epsilon(1e-12));
  }
  const std::string loose = replaced(
      slider_crank, "[driver.guide]\ncoordinate = \"R.y\"\nlaw = { kind = \"polynomial\", coefficients = [0] }\n", "");
  Case free(loose);
  const Sweep balanced = free.sweep("crank.angle", 0.9, -0.4, 14);
  REQUIRE(balanced.points.size() == 14);
  for (const SweepPoint& p : balanced.points) {
    CHECK(p.at.degrees_of_freedom == 1);
    // Moments about P of the slider's weight and of the spring.
    const double x = free.of(p, "R.x"), y = free.of(p, "R.y"), px = free.of(p, "P.x"), py = free.of(p, "P.y");
    const double length = std::hypot(x + 1, y), force = 30 * (length - 1.5);
    const double moment = (x - px) * (-9.81 - force * y / length) - (y - py) * (-force * (x + 1) / length);
    CHECK(moment == Approx(0).margin(1e-10 * 30));
  }
}

TEST_CASE("sweep: where it cannot begin", "[sweep]") {
  Case c(slider_crank);
  CHECK_THROWS_WITH(c.sweep("R.x", 2.5, 2.6, 3, false),
                    Contains("cannot begin") && Contains("only to 1.7 m") && Contains("not to 2.5"));
  CHECK_THROWS_WITH(c.sweep("R.x", 1.3, 1.4, 3), Contains("Too many given positions"));
}
