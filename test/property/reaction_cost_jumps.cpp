// Costs of reactions and of accelerations under forces that jump at times of their own: at index 2 what such a cost
// says is a constraint of the adjoint, which jumps there, at times that parameters move and at others. Against tangents
// by Maggi's equations, which have no multipliers.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

std::string swing(const char* output) {
  return fmt::format(R"toml([gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[bar.r]
from = "A"
to = "P"
mass_kg = 2
[force.f]
point = "P"
y_N = {{ kind = "piecewise", joins = "none", breaks = [1.0, 1.1], coefficients = [[0.0], [9.0], [2.0]] }}
[start]
given = ["P.x"]
[[cost.running]]
kind = "square"
output = "{}"
weight = 0.001
[run]
t_end_s = 2
)toml",
                     output);
}

GradientResult run(const Scene& scene, const char* formulation, const char* method, double rtol) {
  Problem p = make_problem(scene, {"bar.r.mass_kg", "force.f.y_N.breaks[0]"});
  p.formulation = formulation;
  p.solver.set_rtol(rtol);
  return gradient(p, method, p.parameters.values());
}

}  // namespace

TEST_CASE("reaction cost jumps: the adjoint of index 2 goes over jumps of forces, moved or not") {
  for (const char* output : {"r.tension", "P.x_ddot"}) {
    const Scene scene = Scene::parse(swing(output), "swing.toml");
    const GradientResult right = run(scene, "maggi", "cvodes-forward", 1e-10);
    for (const char* formulation : {"index2", "index3"}) {
      INFO(output << " by " << formulation);
      const GradientResult r = run(scene, formulation, "idas-adjoint", 1e-8);
      CHECK(std::abs(r.psi - right.psi) <= 1e-6 * std::abs(right.psi));
      for (std::size_t j = 0; j < 2; ++j)
        CHECK(std::abs(r.gradient[j] - right.gradient[j]) <= 5e-6 * std::abs(right.gradient[1]));
    }
  }
}
