// Exact second derivatives across places at which a force begins with a power 1 < n < 2 of a depth, whose second
// derivative is infinite there: refused by name, and told by differences of gradients, which are held against an energy
// integral of the contact. Where the power is 1, 2 or more, or the place is not passed, nothing is refused.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "costate/base/error.h"
#include "costate/optimize/certificate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/hessian_compare.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;
using Eigen::MatrixXd;

namespace {

Problem steep_problem(const std::string& scene) {
  Problem p = make_problem(Scene::parse(scene, "steep.toml"));
  p.solver.confirm = false;
  p.solver.integrator.clear();
  return p;
}

/// A ball falls from y = 0.4 m, which takes 0.2856 s, and flies up again at 0.6 s.
std::string fallen(const std::string& law, double end = 0.6) {
  return fmt::format(R"([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0.4
vx_m_per_s = 1
[mass.P]
point = "P"
mass_kg = 0.5
[contact.floor]
point = "P"
{}
stiffness_N_per_m_n = 5e3
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = {}
rtol = 1e-10
parameters = ["y", "m", "K"]
[parameter.y]
number = "point.P.y_m"
[parameter.m]
number = "mass.P.mass_kg"
[parameter.K]
number = "contact.floor.stiffness_N_per_m_n"
[[cost.terminal]]
kind = "value"
output = "P.y"
[[cost.terminal]]
kind = "square"
output = "P.y_dot"
)",
                     law, end);
}
std::string power(const char* law, double exponent, const char* more = "") {
  return fmt::format("law = \"{}\"\nexponent = {}\n{}", law, exponent, more);
}
const char* const kRestitution = "restitution = 0.7";

/// What is thrown onto a stop and off it again.
std::string thrown(const std::string& law, double end = 0.9) {
  return fmt::format(R"([point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1.0
y_m = 0
vx_m_per_s = -1.5
[mass.P]
point = "P"
mass_kg = 0.5
[driver.y]
coordinate = "P.y"
law = 0
[spring.s]
from = "O"
to = "P"
stiffness_N_per_m = 5
natural_length_m = 0
spring_law = {}
[start]
given = ["P.x"]
[run]
t_end_s = {}
rtol = 1e-10
parameters = ["x", "m"]
[parameter.x]
number = "point.P.x_m"
[parameter.m]
number = "mass.P.mass_kg"
[[cost.terminal]]
kind = "value"
output = "P.x"
)",
                     law, end);
}
std::string stop(double exponent, double smoothing) {
  return fmt::format("{{ kind = \"bump_stop\", gap = 0.7, stiffness = 400, exponent = {}, smoothing = {} }}", exponent,
                     smoothing);
}

void check_refused(const std::string& scene, const std::string& subject) {
  const Problem p = steep_problem(scene);
  CHECK_THROWS_AS(hessian(p, p.parameters.values()), CapabilityError);
  CHECK_THROWS_WITH(hessian(p, p.parameters.values()),
                    Contains(subject) && Contains("At t = ") && Contains("Differences of gradients tell them"));
}
void check_told(const std::string& scene) {
  const Problem p = steep_problem(scene);
  CHECK_NOTHROW(hessian(p, p.parameters.values()));
}

/// y + y'^2 at 0.6 s of rho = (y0, m, K). Within F = K d^n, d' = +-sqrt(f) with f(d) = v^2 + 2 g d - c d^(n+1) and c =
/// 2 K/((n + 1) m): it is left as fast as it was met. Of the deepest D, with d = D (1 - u^2), f(D) = 0 and E = 1 - (1 -
/// u^2)^(n+1), the time within is 4 sqrt(D) times the integral of 1/sqrt(c D^n E/u^2 - 2 g) over u = 0 to 1: by a
/// double exponential rule, to rounding.
long double bounced_off(long double n, const long double* rho) {
  const long double g = 9.81L, v = std::sqrt(2 * g * rho[0]), c = 2 * rho[2] / ((n + 1) * rho[1]);
  long double D = std::pow(v * v / c, 1 / (n + 1));
  for (int k = 0; k < 50; ++k)
    D -= (v * v + 2 * g * D - c * std::pow(D, n + 1)) / (2 * g - c * (n + 1) * std::pow(D, n));
  const long double pi = std::acos(-1.0L), step = 1.0L / 32;
  long double sum = 0;
  for (int k = -128; k <= 128; ++k) {
    const long double s = k * step, e = std::exp(pi * std::sinh(s)), u = e / (1 + e), rest = 1 / (1 + e),
                      weight = pi * std::cosh(s) * u * rest,
                      E = -std::expm1((n + 1) * (u < 0.5L ? std::log1p(-u * u) : std::log(rest * (1 + u))));
    sum += step * weight / std::sqrt(c * std::pow(D, n) * E / (u * u) - 2 * g);
  }
  const long double left = 0.6L - v / g - 4 * std::sqrt(D) * sum, rate = v - g * left;
  return v * left - g * left * left / 2 + rate * rate;
}

}  // namespace

TEST_CASE("steep hessian: a touch with a power between 1 and 2 is refused by name") {
  for (const double n : {1.05, 1.3, 1.5, 1.9}) {
    CAPTURE(n);
    check_refused(fallen(power("hertz", n)), "contact.floor");
  }
  // Beside an event the way back has a clock that takes powers from 3/2 on.
  for (const char* law : {"flores", "hunt-crossley"})
    check_refused(fallen(power(law, 1.2, kRestitution)), "contact.floor");
  check_refused(thrown(stop(1.1, 0)), "spring.s.spring_law");
  check_refused(thrown(stop(1.5, 0)), "spring.s.spring_law");
  // Beside others in one law it is as steep.
  check_refused(thrown("{ kind = \"sum\", terms = [" + stop(1.3, 0) +
                       ", { kind = \"polynomial\", coefficients = [0, 1, 2, 3] }] }"),
                "spring.s.spring_law");
}

TEST_CASE("steep hessian: nothing is refused of other powers, nor where the place is not passed") {
  check_told(fallen("law = \"linear\""));
  for (const double n : {1.0, 2.0, 2.5}) {
    CAPTURE(n);
    check_told(fallen(power("hertz", n)));
  }
  check_told(fallen(power("flores", 1.5, kRestitution)));
  check_told(fallen(power("hertz", 1.3), 0.25));                 // in flight
  check_told(fallen(power("flores", 1.2, kRestitution), 0.25));  // in flight
  check_told(thrown(stop(2, 0)));
  check_told(thrown(stop(1.3, 0.2)));  // rounded: as the power 3.9 where it begins
  check_told(thrown(stop(1.3, 0), 0.1));
}

TEST_CASE("steep hessian: differences tell it, to what is said of them") {
  for (const double n : {1.3, 1.5}) {
    CAPTURE(n);
    const Problem p = steep_problem(fallen(power("hertz", n)));
    const auto rho = p.parameters.values();
    const Hessian h = hessian_by_differences(p, "cvodes-adjoint", rho);
    const long double at[] = {rho[0], rho[1], rho[2]};
    CHECK(h.psi == Catch::Detail::Approx(static_cast<double>(bounced_off(n, at))).epsilon(1e-7));
    const MatrixXd expected =
        hessian_of([n](const long double* x) { return bounced_off(n, x); }, rho, {4e-4L, 5e-4L, 5.0L});
    // Gradients are known to 1e3 rtol = 1e-7 of their size, over a step of 2e-3: 1e-4.
    const double off = apart(p, h.matrix, expected);
    CAPTURE(off, h.error);
    INFO(h.matrix << "\n\n" << expected);
    CHECK(off < 1e-4 + h.error);
    CHECK(off < 3 * h.error + 1e-6);
    CHECK(h.error < 1e-2);

    OptimizerEvaluation e;
    e.rho = rho;
    e.psi = h.psi;
    e.gradient = h.gradient;
    const Certificate c = certify(p, {}, e, e, "cvodes-adjoint");
    CHECK_THAT(c.note, Contains("differences of gradients by cvodes-adjoint") && Contains("contact.floor"));
    REQUIRE(c.eigenvalues.size() == 3);
  }
}

// Where touches are events the way back has its own clock on either side. Of a drop onto d^(3/2) with damping the run's
// second derivative is -4.51806045, by differences of scipy's DOP853 at 1e-13 through the contact alone, whose free
// flights are closed; its noise is 1e-7. A unit of rounding in the depth, whose root stood in the event's terms, made
// 1.5e-5 of it, what was integrated outside of a short layer 1e-4, and the way back from where it lets go did not get
// on at rtol 1e-10.
TEST_CASE("hessian steep: from touch to release with an exponent of 3/2, against an integral of the contact") {
  const std::string scene = R"([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 1.0
[mass.P]
point = "P"
mass_kg = 1
[contact.f]
point = "P"
law = "hunt-crossley"
stiffness_N_per_m_n = 1e5
exponent = 1.5
restitution = 0.8
ground_height_m = 0.7
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 0.4
parameters = ["point.P.y_m"]
[[cost.terminal]]
kind = "value"
output = "P.y"
)";
  Problem p = steep_problem(scene);
  for (const auto& [rtol, allowed] : {std::pair(1e-8, 3e-5), {1e-10, 5e-7}, {1e-12, 5e-7}}) {
    CAPTURE(rtol);
    p.solver.set_rtol(rtol);
    CHECK(std::abs(hessian(p, p.parameters.values()).matrix(0, 0) / -4.51806045 - 1) <= allowed);
  }
}

// Two bounces, whose second derivatives in the second contact are 270 times what is left behind it.
TEST_CASE("hessian steep: what bounces twice, against differences of gradients") {
  const std::string scene = R"([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0.5
[mass.P]
point = "P"
mass_kg = 0.6
[contact.f]
point = "P"
law = "flores"
stiffness_N_per_m_n = 2e5
restitution = 0.75
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 0.9
rtol = 1e-10
parameters = ["contact.f.restitution"]
[[cost.terminal]]
kind = "value"
output = "P.y"
)";
  Problem p = steep_problem(scene);
  const double found = hessian(p, p.parameters.values()).matrix(0, 0);
  p.formulation = "maggi";
  p.solver.set_rtol(1e-12);
  const auto slope = [&](double by) { return gradient(p, "cvodes-forward", {0.75 + by}).gradient[0]; };
  const double h = 1e-4, right = (8 * (slope(h) - slope(-h)) - (slope(2 * h) - slope(-2 * h))) / (12 * h);
  CHECK(std::abs(found / right - 1) <= 2e-5);
}

// A cost that counts within the contact alone: its second derivatives there are 1,700 times what is left, so that rates
// beside the release have to be told apart, those of the force and those of the cost (1.5e-2 off before). By
// Richardson's differences of gradients of another formulation at 1e-12; scipy's integral of the contact has
// -0.00131784.
TEST_CASE("hessian steep: a cost of penetration behind the release") {
  const std::string scene = R"([gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0.3
[mass.P]
point = "P"
mass_kg = 1.5
[contact.floor]
point = "P"
law = "hunt-crossley"
stiffness_N_per_m_n = 1e6
restitution = 0.7
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 0.4
rtol = 1e-10
parameters = ["point.P.y_m"]
[[cost.running]]
kind = "square"
output = "floor.penetration"
weight = 1000
)";
  const Problem p = steep_problem(scene);
  CHECK(std::abs(hessian(p, p.parameters.values()).matrix(0, 0) / -0.00131781238 - 1) <= 2e-4);
}
