// Weights of costs that are laws of the time, or columns of measured data: against the same cost as a formula, whose
// derivatives are those of outputs, and against sums and integrals over the motion's samples.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "gradient_compare.h"
#include "hessian_compare.h"
#include "support/cases.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

/// A rod with a spring to the wall.
Scene scene(const std::string& rest) {
  return Scene::parse(R"toml([gravity]
y_m_per_s2 = -9.81
[data.run]
columns = ["t [ms]", "w", "x [mm]", "m [kg]"]
rows = [[0, 1, 600, 1], [100, 3, 590, 1], [250, 0.5, 560, 1], [400, 0, 555, 1], [800, 2, 300, 1], [1000, 2, 100, 1]]
[point.A]
ground = true
x_m = 0
y_m = 0
[point.wall]
ground = true
x_m = 1
y_m = -1
[point.P]
x_m = 0.6
y_m = -0.8
[bar.rod]
from = "A"
to = "P"
mass_kg = 2
length_m = 1
[spring.strut]
from = "P"
to = "wall"
stiffness_N_per_m = 20
natural_length_m = 1
damping_N_s_per_m = 1
[start]
given = ["P.x"]
[parameter.c]
number = "spring.strut.damping_N_s_per_m"
[parameter.k]
number = "spring.strut.stiffness_N_per_m"
[run]
t_end_s = 1
)toml" + rest,
                      "weights.toml");
}

const std::string kByLaw = R"toml([[cost.running]]
kind = "square"
output = "P.x"
target = 0.4
weight = { kind = "sine", mean = 1.5, amplitude = 2, angular_frequency_rad_per_s = 5, phase_rad = 0.3 }
[[cost.terminal]]
kind = "value"
output = "P.y_dot"
weight = { kind = "polynomial", coefficients = [0.5, 2] }
[parameter.a]
numbers = ["cost.running[0].weight.amplitude", "cost.terminal[0].weight.coefficients[1]"]
)toml";
const std::string kByFormula = R"toml([output.r]
formula = "(1.5 + a*sin(5*t + 0.3))*(P.x - 0.4)^2"
unit = "m^2"
a = 2
[output.e]
formula = "(0.5 + b*t)*P.y_dot"
unit = "m/s"
b = 2
[[cost.running]]
kind = "value"
output = "r"
[[cost.terminal]]
kind = "value"
output = "e"
[parameter.a]
numbers = ["output.r.a", "output.e.b"]
)toml";

Problem problem(const std::string& rest) {
  Problem p = make_problem(scene(rest), {"c", "k", "a"});
  p.solver.rtol = 1e-9;
  return p;
}

}  // namespace

// Integrators and hand-derived equations keep errors of some hundreds of rtol (gradients.cpp); runs of fixed steps are
// the same ones.
TEST_CASE("weighted costs: by laws, against the same as a formula, by every formulation and method") {
  for (const auto& f : formulations())
    for (const SensitivityMethod& method : sensitivity_methods()) {
      if (method.perturbs || !refusal(method, f).empty()) continue;
      Problem a = problem(kByLaw), b = problem(kByFormula);
      a.formulation = b.formulation = f.name;
      INFO(f.name << " x " << method.name);
      const auto rho = a.parameters.values();
      const GradientResult x = gradient(a, method.name, rho), y = gradient(b, method.name, rho);
      CHECK(x.psi == Approx(y.psi).epsilon(1e-6));
      CHECK_BELOW(gradient_mismatch(x.gradient, y.gradient, a.parameters), 1e-6);
    }
}

TEST_CASE("weighted costs: the Hessian, and a run that ends by an event") {
  Problem a = problem(kByLaw), b = problem(kByFormula);
  a.formulation = b.formulation = "baumgarte";
  const auto rho = a.parameters.values();
  CHECK(apart(a, hessian(a, rho).matrix, hessian(b, rho).matrix) <= 1e-6);
  const std::string ends = "[run.ends_when]\noutput = \"P.x\"\nbelow = 0.3\n";
  a = problem(kByLaw + ends);
  b = problem(kByFormula + ends);
  for (const char* method : {"cvodes-adjoint", "idas-forward", "hand-adjoint"}) {
    INFO(method);
    const GradientResult x = gradient(a, method, rho), y = gradient(b, method, rho);
    CHECK(x.psi == Approx(y.psi).epsilon(1e-6));
    CHECK_BELOW(gradient_mismatch(x.gradient, y.gradient, a.parameters), 1e-6);
  }
}

// Over each piece of the lines by Simpson's rule on the motion's samples: h^4 of (1/50) of a piece.
TEST_CASE("weighted costs: a column of data as weight is the integral over its pieces") {
  const std::string cost = R"toml([[cost.running]]
kind = "square"
output = "P.x"
target = 0.4
weight = { kind = "data", data = "run", column = "w", between = "lines" }
)toml";
  Problem p = make_problem(scene(cost), {"c", "k"});
  p.solver.rtol = 1e-10;
  const double t[] = {0, 0.1, 0.25, 0.4, 0.8, 1}, w[] = {1, 3, 0.5, 0, 2, 2};
  const auto x = make_output(*p.mechanism, "P.x");
  constexpr int kParts = 50;
  double sum = 0;
  for (int piece = 0; piece < 5; ++piece) {
    const double h = (t[piece + 1] - t[piece]) / kParts;
    std::vector<double> times;
    for (int i = 0; i <= kParts; ++i) times.push_back(i < kParts ? t[piece] + i * h : t[piece + 1]);
    int i = 0;
    simulate(p, p.parameters.values(), times, [&](const MechanismState& s, System& system) {
      const double d = x->value(s, system.assembly()) - 0.4, u = (s.t - t[piece]) / (t[piece + 1] - t[piece]);
      sum += h / 3 *
             (i == 0 || i == kParts ? 1
              : i % 2 == 1          ? 4
                                    : 2) *
             (w[piece] + u * (w[piece + 1] - w[piece])) * d * d;
      ++i;
    });
    REQUIRE(i == kParts + 1);
  }
  CHECK(simulate(p, p.parameters.values()).psi == Approx(sum).epsilon(1e-7));
  const auto rho = p.parameters.values();
  Problem oracle = p;
  oracle.solver.integrator = "cvodes";
  const GradientResult right = gradient(oracle, "differences", rho);
  for (const char* method : {"cvodes-adjoint", "idas-adjoint", "hand-adjoint"})
    CHECK_BELOW(gradient_mismatch(gradient(p, method, rho).gradient, right.gradient, p.parameters), 1e-6);
}

TEST_CASE("weighted costs: a column weighs the squares of samples") {
  const std::string cost = R"toml([[cost.samples]]
data = "run"
column = "x"
output = "P.x"
sigma = 0.02
weight_column = "w"
weight = 0.5
)toml";
  Problem p = make_problem(scene(cost), {"c", "k"});
  p.solver.rtol = 1e-10;
  const double w[] = {1, 3, 0.5, 0, 2, 2}, measured[] = {0.6, 0.59, 0.56, 0.555, 0.3, 0.1};
  const auto x = make_output(*p.mechanism, "P.x");
  double sum = 0;
  int k = 0;
  Problem motion = p;
  motion.objective = {};
  simulate(motion, p.parameters.values(), {0, 0.1, 0.25, 0.4, 0.8, 1}, [&](const MechanismState& s, System& system) {
    const double r = (x->value(s, system.assembly()) - measured[k]) / 0.02;
    sum += 0.5 * w[k++] * r * r;
  });
  REQUIRE(k == 6);
  CHECK(simulate(p, p.parameters.values()).psi == Approx(sum).epsilon(1e-7));
}

TEST_CASE("weighted costs: mistakes have their place") {
  const auto with = [](const std::string& rest) { return [=] { make_problem(scene(rest), {"c"}); }; };
  const std::string samples =
      "[[cost.samples]]\ndata = \"run\"\ncolumn = \"x\"\noutput = \"P.x\"\nsigma = 0.02\nweight_column = ";
  CHECK_THROWS_WITH(with(samples + "\"v\"\n")(), Contains("no column 'v'"));
  const std::string running = "[[cost.running]]\nkind = \"value\"\noutput = \"P.x\"\nweight = ";
  CHECK_THROWS_WITH(with(running + "{ kind = \"data\", data = \"run\", column = \"v\" }\n")(),
                    Contains("weights.toml") && Contains("no column 'v'"));
  CHECK_THROWS_WITH(with(running + "\"w\"\n")(), Contains("a number or a law"));
  std::string negative = samples + "\"n\"\n";
  CHECK_THROWS_WITH(make_problem(Scene::parse(
                        "[data.run]\ncolumns = [\"t\", \"x\", \"n\"]\nrows = [[0, 1, 1], [1, 2, -1]]\n[point.P]\nx_m = "
                        "0\ny_m = 0\n[mass.m]\npoint = \"P\"\nmass_kg = 1\n" +
                            negative + "[start]\ngiven = [\"P.x\", \"P.y\"]\n[run]\nt_end_s = 1\n",
                        "negative.toml")),
                    Contains("negative.toml") && Contains("must not be negative"));
}

// An adjoint is about the integral of the cost's gradient: steps crowd in the pulse, so that a mean over evaluations
// would be 5e4 times as large, and with it the absolute tolerances. Right: hand-adjoint at rtol 1e-10.
TEST_CASE("weighted costs: the adjoint of a short weight is known to its own size") {
  Problem p = problem_of_case("pulse_of_weight");
  p.solver.rtol = 1e-10;
  const GradientResult right = gradient(p, "hand-adjoint", p.parameters.values());
  p.solver.rtol = 1e-6;
  p.solver.confirm = false;
  // 1e3 tolerances; on IDAS, whose way back begins at order one behind each place, 1e4.
  for (const auto& [method, part] : {std::pair{"cvodes-adjoint", 1e-3}, {"idas-adjoint", 1e-2}}) {
    const GradientResult r = gradient(p, method, p.parameters.values());
    for (std::size_t j = 0; j < r.gradient.size(); ++j) {
      INFO(method << ", " << p.parameters.parameters[j].name);
      CHECK(r.gradient[j] == Approx(right.gradient[j]).epsilon(part));
    }
  }
  take_notices();
}
