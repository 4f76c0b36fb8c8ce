// A mechanism that is light has small forces: with all masses, stiffnesses and dampings times s the motion is the same,
// reactions and powers are s times as large, and so is what is made of them. A bar of 2 ug on a driver had a gradient
// with the wrong sign, by index 1, 2 and 3 alike: its reactions were taken for rounding.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/mechanism/force_size.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/with_words.h"

using namespace costate;
using namespace costate::test;

namespace {

/// A bar that a driver turns, with a spring and a damper to its end.
const char* kDriven = R"toml(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1.3
y_m = 0.1
[point.G]
ground = true
x_m = 0.4
y_m = -1.1
[bar.b]
from = "A"
to = "P"
mass_kg = MASS
length_m = 1.3
[angle.th]
bar = "b"
[driver.d]
coordinate = "th.angle"
law = { kind = "formula", formula = "a*sin(w*t)", a = 0.5, w = 3 }
[spring.s]
from = "G"
to = "P"
natural_length_m = 0.9
stiffness_N_per_m = STIFFNESS
damping_N_s_per_m = DAMPING
[start]
given = []
[[cost.running]]
COST
[run]
t_end_s = 1.2
parameters = ["spring.s.stiffness_N_per_m", "spring.s.damping_N_s_per_m", "bar.b.mass_kg"]
)toml";

Problem driven(double s, const char* cost) {
  return make_problem(Scene::parse(with_words(kDriven, {{"MASS", fmt::format("{:.17g}", 2 * s)},
                                                        {"STIFFNESS", fmt::format("{:.17g}", 11 * s)},
                                                        {"DAMPING", fmt::format("{:.17g}", 0.8 * s)},
                                                        {"COST", cost}}),
                                   "driven.toml"));
}

}  // namespace

TEST_CASE("light forces: the size of a mechanism's forces is a power of ten, of light ones only") {
  for (const auto& [s, size] : {std::pair{1.0, 1.0}, {1e-3, 1.0}, {1e-6, 1e-4}, {1e-9, 1e-7}})
    CHECK(force_size(*driven(s, "kind = \"value\"\noutput = \"d.power\"").mechanism) == Approx(size));
}

// By 'differences' of the heavy one: -9.361e-2, 1.35871, -1.52349 of the power (closed form: inverse dynamics and
// Gauss's quadrature, to 1e-7).
TEST_CASE("light forces: gradients of reactions and powers scale with them, by every way") {
  struct Case {
    const char* cost;
    int power;  // of the scale in psi
  };
  for (const Case& c :
       {Case{"kind = \"value\"\noutput = \"d.power\"", 1}, {"kind = \"square\"\noutput = \"d.torque\"", 2}}) {
    const Problem heavy = driven(1, c.cost);
    const GradientResult right = gradient(heavy, "hand-tangent", heavy.parameters.values());
    if (c.power == 1) {
      const double known[] = {-0.09361455, 1.3587125, -1.5234859};
      for (std::size_t j = 0; j < 3; ++j) CHECK(std::abs(right.gradient[j] - known[j]) <= 2e-6);
    }
    for (const double s : {1e-3, 1e-5, 1e-7, 1e-9}) {
      for (const auto& [formulation, method] : {std::pair{"baumgarte", "idas-adjoint"},
                                                {"index1", "idas-adjoint"},
                                                {"index2", "idas-adjoint"},
                                                {"index3", "idas-adjoint"},
                                                {"penalty", "idas-adjoint"},
                                                {"index1", "cvodes-adjoint"},
                                                {"maggi", "cvodes-adjoint"},
                                                {"maggi-implicit", "idas-adjoint"},
                                                {"index1", "idas-forward"},
                                                {"index1", "hand-adjoint"},
                                                {"baumgarte", "discrete-adjoint"}}) {
        CAPTURE(c.cost, s, formulation, method);
        Problem light = driven(s, c.cost);
        light.formulation = formulation;
        take_notices();
        const GradientResult r = gradient(light, method, light.parameters.values());
        const bool warned = !take_notices().empty();
        const double unit = std::pow(s, c.power);
        // A way that says so may be off; one without a word is right to 1e-4 of the largest.
        double size = 0;
        for (std::size_t j = 0; j < 3; ++j)
          size = std::max(size, std::abs(right.gradient[j]) * heavy.parameters.parameters[j].scale);
        const double allowed = warned ? 0.5 : 1e-4;
        CHECK(std::abs(r.psi - unit * right.psi) <= 1e-5 * unit * std::abs(right.psi));
        for (std::size_t j = 0; j < 3; ++j) {
          CAPTURE(j, r.gradient[j], right.gradient[j] * unit / s);
          CHECK(std::abs(r.gradient[j] - right.gradient[j] * unit / s) * heavy.parameters.parameters[j].scale <=
                allowed * size * unit / s);
        }
      }
    }
  }
}

// Without a freedom there is no position by which a gradient's integral could be measured: its absolute tolerance was
// 1e-14, and the way back from where a parameter moves the end of a step of the law got stuck there. By 'hand-adjoint'
// and 'cvodes-forward' -1306.20.
TEST_CASE("light forces: a gradient where drivers leave no freedom") {
  Problem p = make_problem(Scene::parse(R"toml(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1.3
y_m = 0.1
[bar.b]
from = "A"
to = "P"
mass_kg = 2
[angle.th]
bar = "b"
[driver.d]
coordinate = "th.angle"
law = { kind = "steps", at = [0.4], values = [0.1, 0.5], width = 0.3 }
[start]
given = []
[[cost.running]]
kind = "square"
output = "d.torque"
[run]
t_end_s = 1
parameters = ["driver.d.law.width"]
)toml",
                                        "steps.toml"));
  const double right = gradient(p, "hand-adjoint", p.parameters.values()).gradient[0];
  CHECK(std::abs(right + 1306.20) <= 0.01);
  for (const char* formulation : {"maggi", "maggi-second-order", "maggi-implicit", "index1"}) {
    CAPTURE(formulation);
    p.formulation = formulation;
    for (const char* method : {"cvodes-adjoint", "idas-adjoint"}) {
      CAPTURE(method);
      double found = right;
      try {
        found = gradient(p, method, p.parameters.values()).gradient[0];
      } catch (const CapabilityError&) {  // not of this formulation
      }
      CHECK(std::abs(found - right) <= 1e-5 * std::abs(right));
    }
  }
}
