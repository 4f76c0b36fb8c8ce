// What stands on two corners holds itself twice along the ground: redundant rows, beside masses from milligrams to what
// weighs a million tons.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

/// Pushed at its top, at the height 2h, by m t/2: the right corner's normal force at t = 2 is m (g/2 + h/b), 2b apart.
Problem box(double mass, double b, double h) {
  return make_problem(Scene::parse(fmt::format(R"toml(
[gravity]
y_m_per_s2 = -9.81
[body.box]
x_m = 0
y_m = {2}
mass_kg = {0}
inertia_kg_m2 = {3}
[point.l]
on = "box"
x_m = -{1}
y_m = -{2}
[point.r]
on = "box"
x_m = {1}
y_m = -{2}
[point.top]
on = "box"
x_m = 0
y_m = {2}
[force.push]
point = "top"
x_N = {{ kind = "polynomial", coefficients = [0, {4}] }}
[contact.l]
kind = "rigid"
point = "l"
friction = "coulomb"
friction_coefficient = 0.6
closed = true
ground_height_m = 0
[contact.r]
kind = "rigid"
point = "r"
friction = "coulomb"
friction_coefficient = 0.6
closed = true
ground_height_m = 0
[start]
given = ["box.x"]
given_velocities = []
[run]
t_end_s = 2
parameters = ["growth"]
[parameter.growth]
number = "force.push.x_N.coefficients[1]"
[[cost.terminal]]
kind = "value"
output = "r.normal_force"
)toml",
                                               mass, b, h, mass * (b * b + h * h) / 3, 0.5 * mass),
                                   "box.toml"));
}

}  // namespace

// Pivots were compared with the largest of all, and one of 20 t beside multipliers was found to be none.
TEST_CASE("rigid contacts: a heavy box stands on two corners", "[events]") {
  struct Size {
    double mass, b, h;
  };
  int rows = 0;
  for (const Size& s : {Size{20000, 2.4, 1.2}, {1e-6, 0.01, 0.01}, {1e9, 500, 20}, {2000, 300, 100}})
    for (const Formulation& f : formulations())
      for (const SensitivityMethod& m : sensitivity_methods()) {
        Problem p = box(s.mass, s.b, s.h);
        p.formulation = f.name;
        if (!refusal(m, f).empty()) continue;
        CAPTURE(s.mass, f.name, m.name);
        GradientResult r;
        try {
          r = gradient(p, m.name, p.parameters.values());
        } catch (const CapabilityError&) {  // methods of fixed steps want theirs
          continue;
        } catch (const SolverError& e) {
          // What carries these rows is lost in rounding beside velocities in the same rows.
          if (m.needs != SensitivityMethod::Needs::discrete && m.name.rfind("hand-", 0) != 0) throw;
          CHECK_THAT(e.what(), Catch::Matchers::Contains("singular"));
          continue;
        }
        ++rows;
        // Rows that give, or are soft: by 1e-5 of shares (acceleration_level.cpp), which normal forces have no part in.
        const double psi = s.mass * (0.5 * 9.81 + s.h / s.b), derivative = 2 * s.h / s.b;
        CHECK(std::abs(r.psi - psi) <= 1e-6 * psi);
        CHECK(std::abs(r.gradient[0] - derivative) <= 1e-5 * derivative);
        take_notices();
      }
  CHECK(rows > 100);
}
