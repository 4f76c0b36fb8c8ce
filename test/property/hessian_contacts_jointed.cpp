// Second derivatives of psi through rigid contacts that close, let go, stick and slide (lib/README.md (13.16),
// (13.17)), of what is jointed: against extrapolated differences of gradients by another formulation and integrator,
// which hold no second derivative; exact ones are symmetric besides.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "property/falling_box.h"
#include "property/hessian_compare.h"
#include "property/rigid_scenes.h"
#include "support/paths.h"
#include "support/with_words.h"

using namespace costate;
using namespace costate::test;

namespace {

/// A hanging rod of two parts over a slope.
Problem rods(const std::string& contact, const char* end) {
  return unconfirmed(with_words(kRods, {{"CONTACT", contact}, {"END", end}}));
}

}  // namespace

TEST_CASE("hessian contacts of joints: a jointed rod's tip lands, slides or sticks, and lets go") {
  for (const char* friction :
       {"", "friction = \"coulomb\"\nfriction_coefficient = 0.1", "friction = \"coulomb\"\nfriction_coefficient = 2.0",
        "friction = \"coulomb\"\nfriction_coefficient = 5.0"}) {
    CAPTURE(friction);
    check_by_differences(rods(friction, "1.2"), 1e-6);
  }
}

TEST_CASE("hessian contacts of joints: Poisson's restitution with friction, of what is jointed") {
  for (const double mu : {0.1, 2.0}) {
    CAPTURE(mu);
    check_by_differences(rods(fmt::format("restitution = 0.5\nrestitution_law = \"poisson\"\nfriction = "
                                          "\"coulomb\"\nfriction_coefficient = {}\nclosing_speed_m_per_s = 0",
                                          mu),
                              "0.6"),
                         1e-6);
  }
}

TEST_CASE("hessian contacts of joints: a hopper opens and closes, a block is pulled to and fro") {
  check_by_differences(
      unconfirmed(with_words(kHopper, {{"FRICTION", ""}, {"GIVEN", "[\"foot.x\", \"top.x\", \"top.y\"]"}})), 1e-6);
  check_by_differences(unconfirmed(kPulledBlock), 1e-6);
}

TEST_CASE("hessian contacts of joints: spokes strike one after the other") {
  check_by_differences(unconfirmed(make_problem(Scene::load(COSTATE_MODELS_DIR "/rimless_wheel/rimless_wheel.toml"))),
                       1e-6);
}

TEST_CASE("hessian contacts of joints: a driver's kink while the floor holds") {
  // A carriage on the floor is driven at 1 m/s from t* on, and pulls a mass by a spring; the kick leaves the floor's
  // row as it is.
  Problem p = unconfirmed(R"([gravity]
y_m_per_s2 = -9.81
[body.cart]
x_m = 0
y_m = 0
mass_kg = 2
inertia_kg_m2 = 0.3
[point.foot]
on = "cart"
x_m = 0.1
y_m = -0.2
[point.hook]
on = "cart"
x_m = 0.2
y_m = 0.1
[point.bob]
x_m = 0.9
y_m = -0.4
[mass.bob]
point = "bob"
mass_kg = 0.4
[spring.S]
from = "hook"
to = "bob"
stiffness_N_per_m = 20
damping_N_s_per_m = 0.3
natural_length_m = 0.7
[contact.floor]
kind = "rigid"
point = "foot"
ground_angle_rad = 0.1
closed = true
[driver.pull]
coordinate = "cart.x"
law = { kind = "piecewise", breaks = [0.3], coefficients = [[0.0, 0.2], [-0.24, 1.0]] }
[start]
given = ["cart.angle", "bob.x", "bob.y"]
[run]
t_end_s = 0.8
rtol = 1e-11
parameters = ["body.cart.mass_kg", "contact.floor.ground_angle_rad", "spring.S.stiffness_N_per_m", "point.foot.x_m"]
[[cost.terminal]]
kind = "square"
output = "cart.angle"
[[cost.running]]
kind = "square"
output = "bob.y"
)");
  check_by_differences(p, 1e-6);
}

TEST_CASE("hessian contacts of joints: the corner of a box in space lands and stays, on a smooth slope") {
  Problem p =
      unconfirmed(with_words(kFallingBox, {{"restitution = 0.6", "ground_angle_rad = 0.1"},
                                           {"closing_speed_m_per_s = 0\n", ""},
                                           {"\"contact.floor.restitution\"", "\"contact.floor.ground_angle_rad\""}}));
  check_by_differences(p, 1e-6);
}
