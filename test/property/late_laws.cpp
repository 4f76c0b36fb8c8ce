// What begins late or is short is met by every run: laws of time in forces, drivers, actuators, winds, roads and costs,
// each from rest, by every formulation, integrator and method. The same run with steps that are bounded from outside is
// the measure: at rest, whoever steps over the law finds psi = 0.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"

using namespace costate;
using Catch::Detail::Approx;

namespace {

/// A body on a spring and damper, at rest and level by two drivers.
std::string scene(const std::string& more, const std::string& level = "0") {
  return R"([body.b]
x_m = 0
y_m = 0
angle_rad = 0
mass_kg = 2
inertia_kg_m2 = 0.1

[point.e]
on = "b"
x_m = 0
y_m = 0

[point.w]
ground = true
x_m = -1
y_m = 0

[driver.level]
coordinate = "b.y"
law = )" +
         level + R"(

[driver.straight]
coordinate = "b.angle"
law = 0

[spring.s]
from = "w"
to = "e"
stiffness_N_per_m = 400
natural_length_m = 1
damping_N_s_per_m = 12

[start]
given = ["b.x"]

[parameter.k]
number = "spring.s.stiffness_N_per_m"

[parameter.m]
number = "body.b.mass_kg"

[run]
t_end_s = 40
parameters = ["k", "m"]
)" + more;
}

/// The motions are some 1e-4 m: with this weight psi is far above its absolute tolerance, which would else be its
/// error.
const std::string kSquare = "\n[[cost.running]]\nkind = \"square\"\noutput = \"b.x\"\nweight = 1e6\n";

/// 1 over 0.02 s at 31 s, in the ways in which a law can say so.
const std::vector<std::pair<std::string, std::string>> kLate = {
    {"bump", R"({ kind = "bump", height_m = 0.5, start_m = 31, length_m = 0.02 })"},
    {"half sine", R"({ kind = "bump", shape = "half_sine", height_m = 1, start_m = 31, length_m = 0.02 })"},
    {"steps", R"({ kind = "steps", at = [31, 31.01], values = [0, 1, 0], width = 0.01 })"},
    {"smooth_steps", R"({ kind = "smooth_steps", x = [0, 31, 31.01, 31.02], y = [0, 0, 1, 0] })"},
    {"table",
     R"({ kind = "table", x = [0, 30.99, 31, 31.01, 31.02, 31.03, 31.04, 40], y = [0, 0, 0, 1, 0, 0, 0, 0] })"},
    {"profile_table",
     R"({ kind = "profile_table", x_m = [0, 30.99, 31, 31.01, 31.02, 31.03, 40], z_m = [0, 0, 0, 1, 0, 0, 0] })"},
    {"piecewise", R"({ kind = "piecewise", breaks = [31, 31.02], coefficients = [[0], [1], [0]], joins = "none" })"},
    {"formula", R"~({ kind = "formula", formula = "exp(-((t-t0)/w)^2)", t0 = 31.0123, w = 0.004 })~"},
    {"product",
     R"({ kind = "product", factors = [{ kind = "steps", at = [31, 31.03], values = [0, 1, 0], width = 0.01 },
        { kind = "sine", amplitude = 1, angular_frequency_rad_per_s = 314.159265358979 }] })"},
    {"scaled",
     R"({ kind = "scaled", slope = 3, nominal_slope = 2, law = { kind = "bump", height_m = 0.5, start_m = 31, length_m = 0.02 } })"},
    {"sum",
     R"({ kind = "sum", terms = [{ kind = "polynomial", coefficients = [0] }, { kind = "bump", height_m = 0.5, start_m = 31, length_m = 0.02 }] })"},
};

std::string force(const std::string& law) { return scene("\n[force.f]\npoint = \"e\"\nx_N = " + law + "\n" + kSquare); }

/// The motions are small: absolute tolerances are far below them.
Problem problem_of(const std::string& text) {
  Problem p = make_problem(Scene::parse(text, "late.toml"));
  p.solver.atol = 1e-11;
  return p;
}

double psi_of(Problem p, const std::string& formulation, const std::string& integrator = "") {
  p.formulation = formulation;
  p.solver.integrator = integrator;
  return simulate(p, p.parameters.values()).psi;
}

/// With steps that cannot pass over anything.
double bounded_psi(Problem p, double step) {
  p.solver.max_step_s = step;
  p.solver.rtol = 1e-9;
  return psi_of(p, "index1");
}

}  // namespace

TEST_CASE("late laws: a force, by every kind of law", "[late]") {
  for (const auto& [name, law] : kLate) {
    INFO(name);
    const Problem p = problem_of(force(law));
    const double right = bounded_psi(p, 0.002);
    REQUIRE(right > 1e-6);
    // Who steps over a law loses all of psi. Within it runs take some dozen steps, each of which may be off by
    // rtol |v| + atol, 6e-11 + 1e-11 of velocities of 6e-3 m/s: after 100 of them by 1e-6 of the motion, and psi is its
    // square. What the bounded run is off by (rtol 1e-9) is less. CVODES, which goes on with the history of the rest,
    // leaves up to 1e-5.
    for (const char* f : {"index1", "baumgarte"})
      for (const char* integrator : {"idas", "cvodes", "dopri5", "dop853"}) {
        INFO(f << " on " << integrator);
        CHECK(psi_of(p, f, integrator) == Approx(right).epsilon(std::string(integrator) == "idas" ? 5e-6 : 1e-4));
      }
  }
}

TEST_CASE("late laws: by every formulation and integrator", "[late]") {
  const Problem p = problem_of(force(kLate.front().second));
  const double right = bounded_psi(p, 0.002);
  for (const Formulation& f : formulations())
    for (const Integrator* integrator : integrators_of(f)) {
      const std::string& which = integrator->name;
      INFO(f.name << " on " << which);
      Problem q = p;
      // Of second order: 20 steps over the bump leave some thousandths.
      // The rest of the run, in which the motion dies away, adds 1e-5 of psi.
      if (which == "fixed") q.solver.step_s = 0.001, q.solver.t_end = 33;
      // Formulations that hold their rows softly (the drivers here) are off by O(1/alpha).
      const bool soft = f.name.starts_with("penalty");
      CHECK(psi_of(q, f.name, which) == Approx(right).epsilon(which == "fixed" ? 1e-2 : soft ? 1e-3 : 5e-6));
    }
}

TEST_CASE("late laws: whatever carries a law of time", "[late]") {
  const std::string bump = R"({ kind = "bump", height_m = 0.05, start_m = 31, length_m = 0.02 })";
  const std::string spring_at_rest = kSquare;
  const std::vector<std::pair<std::string, std::string>> carriers = {
      {"driver", scene("\n[[cost.running]]\nkind = \"square\"\noutput = \"b.y\"\n", bump)},
      {"actuator", scene("\n[actuator.a]\nfrom = \"w\"\nto = \"e\"\ntime_constant_s = 0.005\ncommand_N = " + bump +
                         "\n" + kSquare)},
      {"wind", scene("\n[drag.d]\npoint = \"e\"\ndrag_coefficient = 1\narea_m2 = 4\nwind_x_m_per_s = "
                     R"({ kind = "bump", height_m = 5, start_m = 31, length_m = 0.02 })"
                     "\n" +
                     kSquare)},
      {"target of the cost", scene("\n[[cost.running]]\nkind = \"square\"\noutput = \"b.x\"\ntarget = " + bump + "\n")},
  };
  for (const auto& [name, text] : carriers) {
    INFO(name);
    const Problem p = problem_of(text);
    const double right = bounded_psi(p, 0.002);
    REQUIRE(right > 0);
    for (const char* f : {"index1", "baumgarte", "maggi"}) {
      INFO(f);
      CHECK(psi_of(p, f) == Approx(right).epsilon(1e-3));
    }
  }
}

TEST_CASE("late laws: a wheel that comes to a bump", "[late]") {
  // In balance on its tyre, at 10 m/s: the bump of 0.2 m is 300 m ahead.
  const Problem p = problem_of(R"([gravity]
z_m_per_s2 = -9.81
[rigid_body.w]
x_m = 0
y_m = 0
z_m = 0.33
vx_m_per_s = 10
mass_kg = 100
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.c]
on = "w"
x_m = 0
y_m = 0
z_m = 0
[road.r]
kind = "profile"
law = { kind = "bump", height_m = 0.002, start_m = 300, length_m = 0.2 }
[tyre.t]
wheel = "c"
axis = [0, 1, 0]
road = "r"
model = "ride"
contact = "vertical"
radius_m = 0.34
stiffness_N_per_m = 98100
damping_N_s_per_m = 800
[start]
given = ["w"]
[[cost.running]]
kind = "square"
output = "w.z_dot"
[parameter.k]
number = "tyre.t.damping_N_s_per_m"
[run]
t_end_s = 33
parameters = ["k"]
)");
  const double right = bounded_psi(p, 0.002);
  REQUIRE(right > 1e-6);
  for (const char* f : {"index1", "baumgarte", "maggi", "augmented-lagrangian"}) {
    INFO(f);
    CHECK(psi_of(p, f) == Approx(right).epsilon(1e-3));
  }
  const GradientResult reference = gradient(p, "cvodes-forward", p.parameters.values());
  for (const char* method : {"idas-adjoint", "cvodes-adjoint", "hand-adjoint"}) {
    INFO(method);
    const test::Mismatch m =
        test::gradient_mismatch(gradient(p, method, p.parameters.values()).gradient, reference.gradient, p.parameters);
    INFO(m.text);
    CHECK(m.error < 1e-3);
  }
}

TEST_CASE("late laws: gradients and Hessians", "[late]") {
  Problem p = problem_of(force(kLate.front().second));
  Problem bounded = p;
  bounded.solver.max_step_s = 0.002;
  const GradientResult right = gradient(bounded, "idas-forward", p.parameters.values());
  for (const char* formulation : {"index1", "baumgarte", "maggi"})
    for (const auto& m : sensitivity_methods()) {
      if (m.name == "differences" || m.name.starts_with("discrete")) continue;
      if (!refusal(m, find_formulation(formulation)).empty()) continue;
      INFO(formulation << " " << m.name);
      p.formulation = formulation;
      const GradientResult r = gradient(p, m.name, p.parameters.values());
      const test::Mismatch off = test::gradient_mismatch(r.gradient, right.gradient, p.parameters);
      INFO(off.text);
      CHECK(off.error < 1e-3);
    }
  p.formulation = bounded.formulation = "index1";
  const Hessian found = hessian(p, p.parameters.values()), reference = hessian(bounded, p.parameters.values());
  CHECK(found.psi == Approx(right.psi).epsilon(1e-4));
  // Entries count in scaled parameters, against the largest.
  Eigen::VectorXd scale(reference.matrix.rows());
  for (Eigen::Index j = 0; j < scale.size(); ++j) scale[j] = p.parameters.parameters[static_cast<std::size_t>(j)].scale;
  const auto scaled = [&](const Eigen::MatrixXd& m) -> Eigen::MatrixXd {
    return scale.asDiagonal() * m * scale.asDiagonal();
  };
  CHECK(scaled(found.matrix - reference.matrix).cwiseAbs().maxCoeff() <
        1e-3 * scaled(reference.matrix).cwiseAbs().maxCoeff());
}

TEST_CASE("late laws: a late cost alone, seen from the end", "[late]") {
  // The motion goes on all the time; the cost looks at it for 0.02 s only.
  Problem p = problem_of(scene(R"(
[force.f]
point = "e"
x_N = 3
[[cost.running]]
kind = "value"
output = "b.x"
weight = 0
target = { kind = "bump", height_m = 1, start_m = 31, length_m = 0.02 }
[[cost.running]]
kind = "square"
output = "b.x"
weight = 1e6
target = { kind = "bump", height_m = 1, start_m = 31, length_m = 0.02 }
)"));
  // IDAS's adjoint at its default of 1e-8 is off by 1.5e-4, where the cost begins after long steps.
  p.solver.rtol = 1e-10;
  Problem bounded = p;
  bounded.solver.max_step_s = 0.002;
  const auto rho = p.parameters.values();
  const std::vector<double> right = gradient(bounded, "idas-forward", rho).gradient;
  for (const char* method : {"idas-adjoint", "cvodes-adjoint", "hand-adjoint", "cvodes-forward"}) {
    INFO(method);
    const test::Mismatch off = test::gradient_mismatch(gradient(p, method, rho).gradient, right, p.parameters);
    INFO(off.text);
    CHECK(off.error < 1e-4);
  }
}

TEST_CASE("late laws: few checkpoints", "[late]") {
  // Segments that are repeated from checkpoints look at the same places.
  Problem p = problem_of(force(kLate.front().second));
  const auto rho = p.parameters.values();
  const std::vector<double> right = gradient(p, "idas-adjoint", rho).gradient;
  p.solver.checkpoint_steps = 20;
  for (const char* method : {"idas-adjoint", "cvodes-adjoint"}) {
    INFO(method);
    const GradientResult r = gradient(p, method, rho);
    CHECK(r.counters.checkpoints > 2);
    const test::Mismatch off = test::gradient_mismatch(r.gradient, right, p.parameters);
    INFO(off.text);
    CHECK(off.error < 1e-3);
  }
}

TEST_CASE("late laws: fixed steps that pass over one are refused", "[late]") {
  Problem p = problem_of(force(kLate.front().second));
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 0.5;
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Catch::Contains("force 'f'") && Catch::Contains("t = 31 s"));
}

TEST_CASE("late laws: a kink asks for no shorter steps than what it parts", "[late]") {
  // x'' = c |sin 40 t|: x(2) and psi = x(2)^2 by quadrature between the kinks. Cells halved towards each kink to 1e-7
  // of the run, and no fixed step was found at all.
  Problem p = problem_of(
      "[point.P]\nx_m = 0\ny_m = 0\n[mass.m]\npoint = \"P\"\nmass_kg = 1\n[force.f]\npoint = \"P\"\n"
      "formula_x_N = \"c*abs(sin(40*t))\"\nc = 3\n[[cost.terminal]]\nkind = \"square\"\noutput = \"P.x\"\n[run]\n"
      "t_end_s = 2\nparameters = [\"force.f.c\"]\n");
  const double psi = 14.587208411134142, slope = 2 * psi / 3;
  p.formulation = "index3";
  const GradientResult fixed = gradient(p, "discrete-adjoint", {3});
  CHECK(fixed.counters.steps < 2000);
  CHECK(fixed.psi == Approx(psi).epsilon(1e-4));  // chosen for 1e-5
  CHECK(fixed.gradient[0] == Approx(slope).epsilon(1e-4));
  p.formulation = "baumgarte";
  for (const char* integrator : {"dop853", "radau5"}) {
    p.solver.integrator = integrator;
    const GradientResult r = gradient(p, "discrete-adjoint", {3});
    INFO(integrator << ": " << r.counters.steps << " steps");
    CHECK(r.counters.steps < 800);  // some 20 between two of 25 kinks; 1,245 and 1,347 before
    CHECK(r.psi == Approx(psi).epsilon(1e-7));
    CHECK(r.gradient[0] == Approx(slope).epsilon(1e-7));
  }
}

TEST_CASE("late laws: a fixed step that is refused is told one that is not", "[late]") {
  // Two bumps, of which the later one is the shorter: what the first asks for passes over the second.
  Problem p = problem_of(scene(R"(
[force.f]
point = "e"
x_N = { kind = "bump", height_m = 0.5, start_m = 2.4, length_m = 0.005 }
[force.g]
point = "e"
x_N = { kind = "bump", height_m = 0.5, start_m = 4.4, length_m = 0.001 }
)" + kSquare));
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 0.15;
  std::string told;
  try {
    simulate(p, p.parameters.values());
  } catch (const SolverError& e) {
    told = e.what();
  }
  const std::string needs = "needs steps of ";
  REQUIRE(told.find(needs) != std::string::npos);
  p.solver.step_s = std::stod(told.substr(told.find(needs) + needs.size()));
  CHECK(p.solver.step_s < 0.001);
  CHECK_NOTHROW(simulate(p, p.parameters.values()));
}
