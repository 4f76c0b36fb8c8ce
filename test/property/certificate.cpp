// The certificate of an optimization belongs to the optimum's own motion: where the run of the Hessian found another
// one, there is no verdict, and where both found the same up to their tolerances, there is.
#include "costate/optimize/certificate.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Matchers::Contains;
using Kind = Certificate::Kind;

namespace {

/// A mass on a spring and damper, pulled by `pull` for a tenth of a second.
Problem problem(double pull, double length, const std::string& weight = "1") {
  const Scene scene = Scene::parse(fmt::format(R"([body.b]
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
law = 0

[driver.straight]
coordinate = "b.angle"
law = 0

[spring.s]
from = "w"
to = "e"
stiffness_N_per_m = 400
natural_length_m = {}
damping_N_s_per_m = 12

[force.kick]
point = "e"
x_N = {{ kind = "steps", at = [1, 1.1], values = [0, {}, 0], width = 0.02 }}

[start]
given = ["b.x"]

[parameter.length]
number = "spring.s.natural_length_m"
scale = 1

[run]
t_end_s = 2
rtol = 1e-8
formulation = "baumgarte"
parameters = ["length"]

[[cost.running]]
kind = "square"
weight = {}
output = "b.x"
)",
                                               length, pull, weight),
                                   "scene");
  return make_problem(scene);
}

OptimizerEvaluation evaluation(const Problem& p) {
  OptimizerEvaluation e;
  e.index = 1;
  e.rho = p.parameters.values();
  const GradientResult r = gradient(p, "idas-adjoint", e.rho);
  e.psi = r.psi;
  e.gradient = r.gradient;
  e.projected_gradient = std::abs(r.gradient[0]);
  return e;
}

}  // namespace

TEST_CASE("certificate: no verdict where the Hessian's run found another motion") {
  const Problem rest = problem(0, 1), kicked = problem(400, 1);
  const OptimizerEvaluation at_rest = evaluation(rest), after_kick = evaluation(kicked);
  REQUIRE(std::abs(at_rest.psi) < 1e-20);
  REQUIRE(after_kick.psi > 0.01);
  for (const bool skipped_by_hessian : {false, true}) {
    INFO(skipped_by_hessian);
    const OptimizerEvaluation& e = skipped_by_hessian ? after_kick : at_rest;
    const Certificate c = certify(skipped_by_hessian ? rest : kicked, {}, e, e, "idas-adjoint");
    INFO(c.verdict);
    CHECK(c.kind == Kind::none);
    CHECK_THAT(c.verdict, Contains("no verdict") && Contains("another motion") && Contains("psi is "));
  }
}

TEST_CASE("certificate: a psi that vanishes is the same motion's, whatever rounding leaves of it") {
  // At rest psi is 0 and a minimum; a fraction of psi is no measure there. 1e-8 of the natural length beside it, the
  // two runs' psi of some 1e-16 have no digit in common.
  for (const double length : {1.0, 1 + 1e-8, 1 + 1e-6}) {
    INFO(length);
    const Problem p = problem(0, length);
    const OptimizerEvaluation e = evaluation(p);
    CHECK(std::abs(e.psi) < 1e-10);
    const Certificate c = certify(p, {}, e, e, "idas-adjoint");
    INFO(c.verdict);
    CHECK(c.kind == Kind::strict_minimum);
    // A maximum with psi turned over is told, too.
    const Problem over = problem(0, length, "-1");
    const OptimizerEvaluation top = evaluation(over);
    CHECK(certify(over, {}, top, top, "idas-adjoint").kind == Kind::indefinite);
  }
}

TEST_CASE("certificate: a small difference of psi that is more than parameters' rounding is another motion") {
  // psi a thousandth of the kick's, against 0.
  const Problem rest = problem(0, 1), kicked = problem(400, 1);
  OptimizerEvaluation e = evaluation(rest);
  const OptimizerEvaluation far = evaluation(kicked);
  e.psi = 1e-3 * far.psi;
  const Certificate c = certify(rest, {}, e, e, "idas-adjoint");
  INFO(c.verdict);
  CHECK(c.kind == Kind::none);
}

TEST_CASE("certificate: a verdict that a loose run of the Hessian settles takes no tight one") {
  // Psi curves along the length: one direction, known to four digits by a run at 1e-7 and one at 1e-6.
  const auto taken = [](double rtol, Certificate& c) {
    Problem p = problem(0, 1);
    p.solver.set_rtol(rtol);
    const OptimizerEvaluation e = evaluation(p);
    long calls = 0;
    p.monitor = [&](double, long, bool) { ++calls; };
    c = certify(p, {}, e, e, "idas-adjoint");
    return calls;
  };
  Certificate loose, tight;
  const long at_first = taken(1e-6, loose), later = taken(1e-12, tight);
  REQUIRE(at_first > 0);
  // The same runs; at 1e-13 they would be some five times as long.
  CHECK(later == at_first);
  CHECK(tight.kind == Kind::strict_minimum);
  REQUIRE(tight.eigenvalues.size() == 1);
  CHECK(tight.eigenvalue_error <= 1e-3 * tight.eigenvalues[0]);
  CHECK(std::abs(tight.eigenvalues[0] - loose.eigenvalues[0]) <= loose.eigenvalue_error + tight.eigenvalue_error);
}
