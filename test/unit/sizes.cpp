// The same mechanism in other units: lengths times s, masses times m, gravity times s, stiffness and damping times m.
// Time stays, so that psi, a square of lengths over time, is s^2 times as large, and so are its derivatives in relative
// terms.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/integrator/simulate.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/level/penalty_weight.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

/// Two bars of very different masses with a spring: drives, free points, massless angles.
Scene double_pendulum(double s, double m) {
  return Scene::parse(
      fmt::format(R"(
[gravity]
y_m_per_s2 = {g}
[point.A]
ground = true
x_m = 0
y_m = 0
[point.W]
ground = true
x_m = {w}
y_m = {h}
[point.P]
x_m = {px}
y_m = {py}
[point.Q]
x_m = {qx}
y_m = {qy}
[bar.r1]
from = "A"
to = "P"
mass_kg = {m1}
length_m = {l}
[bar.r2]
from = "P"
to = "Q"
mass_kg = {m2}
length_m = {l}
[spring.s]
from = "Q"
to = "W"
stiffness_N_per_m = {k}
natural_length_m = {l}
damping_N_s_per_m = {c}
[start]
given = ["P.x", "Q.x"]
[[cost.running]]
kind = "square"
output = "Q.x"
[run]
t_end_s = 1
rtol = 1e-9
parameters = ["bar.r1.mass_kg", "bar.r2.length_m", "spring.s.stiffness_N_per_m"]
)",
                  fmt::arg("g", -9.81 * s), fmt::arg("w", 1.5 * s), fmt::arg("h", 0.5 * s), fmt::arg("px", 0.6 * s),
                  fmt::arg("py", -0.8 * s), fmt::arg("qx", 1.4 * s), fmt::arg("qy", -1.4 * s), fmt::arg("m1", 1.3 * m),
                  fmt::arg("m2", 0.2 * m), fmt::arg("l", s), fmt::arg("k", 50 * m), fmt::arg("c", m)),
      "double_pendulum.toml");
}

}  // namespace

TEST_CASE("the size of a mechanism gives its psi and gradient a factor, in every formulation") {
  for (const char* formulation : {"index1", "baumgarte", "penalty", "augmented-lagrangian", "maggi", "index2"}) {
    std::vector<double> expected;
    for (const auto& [s, m] : {std::pair(1.0, 1.0), std::pair(1e-3, 1.0), std::pair(1e-5, 1.0), std::pair(1e-6, 1e-12),
                               std::pair(1.0, 1e-12), std::pair(1e3, 1e6), std::pair(1e6, 1e6)}) {
      const Scene scene = double_pendulum(s, m);
      Problem p = make_problem(scene);
      p.formulation = formulation;
      const std::string method = std::string(formulation) == "index1" || std::string(formulation) == "index2"
                                     ? "idas-forward"
                                     : "cvodes-adjoint";
      const auto rho = p.parameters.values();
      const GradientResult r = gradient(p, method, rho);
      std::vector<double> found = {r.psi / (s * s)};
      for (std::size_t j = 0; j < rho.size(); ++j) found.push_back(r.gradient[j] * rho[j] / (s * s));
      if (expected.empty()) expected = found;
      INFO(formulation << ", lengths times " << s << ", masses times " << m);
      // Errors of gradients are usually up to some hundred times rtol = 1e-9, here of both: a thousand of each.
      for (std::size_t i = 0; i < found.size(); ++i)
        CHECK(std::abs(found[i] - expected[i]) <= 2e-6 * std::abs(expected[i]));
    }
  }
}

TEST_CASE("the default penalty weight follows the units of lengths and masses") {
  const double weight = default_penalty_weight(double_pendulum(1, 1).mechanism());
  for (const auto& [s, m] : {std::pair(1e-3, 1.0), std::pair(1e-6, 1e-12), std::pair(1e3, 1e6)})
    CHECK(default_penalty_weight(double_pendulum(s, m).mechanism()) == Approx(weight * m / (s * s)).epsilon(1e-12));
}

TEST_CASE("absolute tolerances keep their number from 0.1 m on") {
  CHECK(length_size(*double_pendulum(1, 1).mechanism()) == 1);
  CHECK(length_size(*double_pendulum(0.07, 1).mechanism()) == 1);
  CHECK(length_size(*double_pendulum(1e-3, 1).mechanism()) == Approx(1e-2).epsilon(1e-12));
  CHECK(length_size(*double_pendulum(1e-5, 1).mechanism()) == Approx(1e-4).epsilon(1e-12));
}

namespace {

/// A body that spins about its middle axis, 1e6 times slower than models/rigid_body/dzhanibekov.
std::string slow_top(const std::string& more = "", double factor = 1e-6) {
  return more + fmt::format(R"(
[rigid_body.body]
x_m = 0
y_m = 0
z_m = 0
mass_kg = 1
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 2
inertia_zz_kg_m2 = 3
omega_x_rad_per_s = {}
omega_y_rad_per_s = {}
omega_z_rad_per_s = {}
[start]
given = ["body"]
[[cost.running]]
kind = "square"
output = "body.omega_x"
[run]
t_end_s = 10
)",
                            0.01 * factor, 5 * factor, 0.02 * factor);
}

}  // namespace

TEST_CASE("sizes: a slow motion that nothing drives is a fast one with another clock") {
  const auto rate = [](const std::string& text) { return rate_size(*Scene::parse(text, "top.toml").mechanism()); };
  CHECK(rate(slow_top()) == Approx(1e-5));
  CHECK(rate(slow_top("", 1)) == 1);
  CHECK(rate(slow_top("", 0)) == 1);
  CHECK(rate(slow_top("[gravity]\nz_m_per_s2 = -9.81\n")) == 1);
  // Euler's equations to second order in time: change of omega_z = (Ixx - Iyy) / Izz omega_y (omega_x t + omega_x' t^2
  // / 2) with omega_x' = (Iyy - Izz) / Ixx omega_y omega_z; the next term is of 5e-10. Within 1e4 rtol of that, as
  // every output; with 1e-8 rad/s tolerated of speeds of 5e-6 the change was off by 2 %.
  const Scene scene = Scene::parse(slow_top(), "top.toml");
  Problem problem = make_problem(scene);
  problem.formulation = "baumgarte";
  problem.solver.integrator = "cvodes";
  problem.solver.rtol = 1e-8;
  const auto omega_z = make_output(*problem.mechanism, "body.omega_z");
  double last = 0;
  simulate(problem, {}, {10.0},
           [&](const MechanismState& s, System& system) { last = omega_z->value(s, system.assembly()); });
  const double change = -1.0 / 3 * 5e-6 * (1e-8 * 10 - 5e-6 * 2e-8 * 50);
  CHECK(last - 2e-8 == Approx(change).epsilon(1e-4));
}
