// The Hessian by differences of gradients, which stands in where no exact products are offered: on a ball that bounces,
// whose psi is known in closed form, and beside the exact one where there is one.
#include "costate/sensitivity/difference_hessian.h"

#include <support/models.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/optimize/certificate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/hessian_compare.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;
using Eigen::MatrixXd;

namespace {

/// A ball that falls from 1 m: the height at 2.8 s plus its integral until then, of the height at the start, the
/// restitution and the ground's height.
long double dropped(const long double* p) {
  const long double g = 9.81L, end = 2.8L, ground = p[2];
  long double t = std::sqrt(2 * (p[0] - ground) / g), v = g * t, psi = p[0] * t - g * t * t * t / 6;
  for (;;) {
    v *= p[1];
    const long double left = end - t, h = std::min(2 * v / g, left);
    psi += ground * h + v * h * h / 2 - g * h * h * h / 6;
    if (h == left) return psi + ground + v * h - g * h * h / 2;
    t += h;
  }
}

/// Two of them at once: what happens in one instant has gradients, as neither knows of the other, and no second
/// derivatives.
constexpr const char* kTwins = R"([gravity]
y_m_per_s2 = -9.81
[point.ball]
x_m = 0
y_m = 1
[mass.ball]
point = "ball"
mass_kg = 1
[contact.floor]
kind = "rigid"
point = "ball"
restitution = 0.8
[point.twin]
x_m = 3
y_m = 1
[mass.twin]
point = "twin"
mass_kg = 2
[contact.other]
kind = "rigid"
point = "twin"
restitution = 0.8
[parameter.height]
numbers = ["point.ball.y_m", "point.twin.y_m"]
[parameter.restitution]
numbers = ["contact.floor.restitution", "contact.other.restitution"]
[parameter.ground]
numbers = ["contact.floor.ground_height_m", "contact.other.ground_height_m"]
[start]
given = ["ball.x", "ball.y", "twin.x", "twin.y"]
[run]
t_end_s = 2.8
rtol = 1e-10
formulation = "index1"
method = "cvodes-adjoint"
parameters = ["height", "restitution", "ground"]
[[cost.terminal]]
kind = "value"
output = "ball.y"
weight = 0.5
[[cost.running]]
kind = "value"
output = "ball.y"
weight = 0.5
[[cost.terminal]]
kind = "value"
output = "twin.y"
weight = 0.5
[[cost.running]]
kind = "value"
output = "twin.y"
weight = 0.5
)";

MatrixXd dropped_hessian(const std::vector<double>& rho) { return hessian_of(dropped, rho, {1e-3L, 1e-3L, 1e-3L}); }

}  // namespace

TEST_CASE("difference hessian: a ball that bounces, against its closed form") {
  const Problem p = make_problem(Scene::parse(kTwins, "twins.toml"));
  const auto rho = p.parameters.values();
  const Hessian h = hessian_by_differences(p, "cvodes-adjoint", rho);
  const long double at[] = {rho[0], rho[1], rho[2]};
  CHECK(h.psi == Catch::Detail::Approx(static_cast<double>(dropped(at))).epsilon(1e-7));
  // Gradients are known to 1e3 rtol = 1e-7, over a step of 2e-3: 1e-4; the extrapolation's own change is in asymmetry.
  const double off = apart(p, h.matrix, dropped_hessian(rho));
  CAPTURE(off, h.asymmetry);
  CHECK(off < 1e-4);
  CHECK(off < 3 * h.asymmetry + 1e-6);
  CHECK(h.asymmetry < 1e-3);
  CHECK(h.error >= h.asymmetry);

  OptimizerEvaluation e;
  e.rho = rho;
  e.psi = h.psi;
  e.gradient = h.gradient;
  const Certificate c = certify(p, {}, e, e, "cvodes-adjoint");
  CHECK_THAT(c.note,
             Contains("differences of gradients by cvodes-adjoint") && Contains("in the instant of another event"));
  CHECK(c.formulation == p.formulation);
  CHECK(c.asymmetry > 0);
  // What the differences leave open is what is known of the eigenvalues, too.
  const double largest = largest_scaled(scales(p.parameters), h.matrix);
  CHECK(c.eigenvalue_error >= 0.99 * h.asymmetry * largest);
  CHECK(c.curvature_tolerance >= c.eigenvalue_error);
}

TEST_CASE("difference hessian: beside the exact one, within bounds and at them") {
  Problem p = five_bar().problem("index1", 1e-10, {"k1", "k2", "L01"});
  const auto rho = p.parameters.values();
  const Hessian exact = hessian(p, rho);
  for (const int at_bound : {0, 1, 2}) {
    Problem bounded = p;
    auto& of = bounded.parameters.parameters;
    if (at_bound == 1) of[0].lower = rho[0];
    if (at_bound == 2) of[1].upper = rho[1];
    const Hessian h = hessian_by_differences(bounded, "idas-adjoint", rho);
    const double off = apart(p, h.matrix, exact.matrix);
    CAPTURE(at_bound, off, h.asymmetry);
    // Noise as above; one-sided extrapolations leave (4e-3)^3 of the fourth derivative.
    CHECK(off < (at_bound == 0 ? 1e-4 : 1e-3));
    CHECK(off < 3 * h.asymmetry + 1e-6);
  }
}
