// Second derivatives of psi where forces bend on the way: what a derivative's jump adds at an instant that moves
// (lib/README.md (13.13)). Against a closed form, and against differences of gradients, which hold no second
// derivative.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/difference_hessian.h"
#include "property/hessian_compare.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;
using Eigen::MatrixXd;

namespace {

/// A wheel NAME that falls from 2.2 m onto its tyre.
std::string wheel(const std::string& name, double x_m, double stiffness) {
  return fmt::format(R"([rigid_body.w{0}]
x_m = {1}
y_m = 0
z_m = 2.2
mass_kg = 20
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub{0}]
on = "w{0}"
x_m = 0
y_m = 0
z_m = 0
[tyre.T{0}]
wheel = "hub{0}"
road = "R"
model = "ride"
radius_m = 0.3
stiffness_N_per_m = {2}
[[cost.terminal]]
kind = "square"
output = "w{0}.z"
target = 1.5
[[cost.terminal]]
kind = "square"
output = "w{0}.z_dot"
target = 3
[parameter.z{0}]
number = "rigid_body.w{0}.z_m"
[parameter.k{0}]
number = "tyre.T{0}.stiffness_N_per_m"
)",
                     name, x_m, stiffness);
}
std::string scene(const std::string& wheels, const std::string& given, const std::string& parameters) {
  return fmt::format(R"([gravity]
z_m_per_s2 = -9.81
[road.R]
kind = "flat"
{}
[start]
given = [{}]
[run]
t_end_s = 1
parameters = [{}]
)",
                     wheels, given, parameters);
}
Problem landing() {
  return make_problem(Scene::parse(scene(wheel("", 0, 8e4), R"("w")", R"("z", "k")"), "landing.toml"));
}

/// Free fall, a vibration about the static deflection until the tyre lets go, free flight.
long double landed(long double z0, long double k) {
  const long double g = 9.81L, w = std::sqrt(k / 20), fall = std::sqrt(2 * (z0 - 0.3L) / g), v = -g * fall,
                    a = g / (w * w), b = v / w, pi = std::acos(-1.0L),
                    touch = std::fmod(2 * std::atan2(b, a) + 2 * pi, 2 * pi) / w, flight = 1 - fall - touch,
                    z = 0.3L - v * flight - 0.5L * g * flight * flight, rate = -v - g * flight;
  return (z - 1.5L) * (z - 1.5L) + (rate - 3) * (rate - 3);
}

MatrixXd landed_hessian(const std::vector<double>& rho) {
  return hessian_of([](const long double* p) { return landed(p[0], p[1]); }, rho, {1e-3L * rho[0], 1e-3L * rho[1]});
}

void agree(Problem p, const char* method = "cvodes-adjoint") {
  const auto rho = p.parameters.values();
  Problem tight = p;
  tight.solver.rtol = std::min(1e-11, 1e-3 * p.solver.rtol);
  tight.formulation = "baumgarte";
  const Hessian expected = hessian_by_differences(tight, method, rho);
  for (const char* formulation : {"index1", "baumgarte", "penalty"}) {
    p.formulation = formulation;
    const Hessian h = hessian(p, rho);
    const double off = apart(p, h.matrix, expected.matrix);
    CAPTURE(formulation, off, h.asymmetry, expected.asymmetry);
    INFO(h.matrix << "\n\n" << expected.matrix);
    CHECK(h.asymmetry < 1e-5);
    CHECK(off < 3 * expected.asymmetry + 1e-5);
    CHECK(expected.asymmetry < 1e-3);
  }
}

/// A mass on a spring that goes round and in and out.
std::string on_spring(const std::string& law, const std::string& cost, const std::string& number = "") {
  return fmt::format(R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0.2
[mass.a]
point = "P"
mass_kg = 1
[spring.s]
from = "O"
to = "P"
stiffness_N_per_m = 40
natural_length_m = 1
{}
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 2
rtol = 1e-9
parameters = ["k", "l", "m"{}]
{}
[parameter.k]
number = "spring.s.stiffness_N_per_m"
[parameter.l]
number = "spring.s.natural_length_m"
[parameter.m]
number = "mass.a.mass_kg"
{}
)",
                     law, number.empty() ? "" : ", \"c\"", cost,
                     number.empty() ? "" : fmt::format("[parameter.c]\nnumber = \"{}\"", number));
}
constexpr const char* kPath = "[[cost.running]]\nkind = \"square\"\noutput = \"P.x\"\n";

}  // namespace

TEST_CASE("hessian bends: a tyre that lands and leaves, against its closed form") {
  Problem p = landing();
  const auto rho = p.parameters.values();
  const MatrixXd expected = landed_hessian(rho);
  for (const double rtol : {1e-7, 1e-9}) {
    p.solver.rtol = rtol;
    for (const char* formulation : {"index1", "baumgarte"}) {
      p.formulation = formulation;
      const Hessian h = hessian(p, rho);
      const double off = apart(p, h.matrix, expected);
      CAPTURE(rtol, formulation, off, h.asymmetry);
      INFO(h.matrix << "\n\n" << expected);
      CHECK(off < 1e3 * rtol);
      CHECK(h.asymmetry < 1e3 * rtol);
    }
  }
}

TEST_CASE("hessian bends: two tyres that land at once and are moved apart, against their closed form") {
  // One instant, which each wheel's parameters move for itself alone: what jumps there is shared out among the forces.
  Problem p = make_problem(Scene::parse(
      scene(wheel("A", 0, 8e4) + wheel("B", 2, 6e4), R"("wA", "wB")", R"("zA", "kA", "zB", "kB")"), "two.toml"));
  p.solver.rtol = 1e-9;
  const auto rho = p.parameters.values();
  MatrixXd expected = MatrixXd::Zero(4, 4);
  expected.topLeftCorner(2, 2) = landed_hessian({rho[0], rho[1]});
  expected.bottomRightCorner(2, 2) = landed_hessian({rho[2], rho[3]});
  for (const char* formulation : {"index1", "baumgarte"}) {
    p.formulation = formulation;
    const Hessian h = hessian(p, rho);
    const double off = apart(p, h.matrix, expected);
    CAPTURE(formulation, off, h.asymmetry);
    INFO(h.matrix << "\n\n" << expected);
    CHECK(off < 1e-6);
    CHECK(h.asymmetry < 1e-6);
  }
}

TEST_CASE("hessian bends: what is known of a Hessian is told") {
  Problem p = landing();
  const auto rho = p.parameters.values();
  const MatrixXd expected = landed_hessian(rho);
  for (const double rtol : {1e-4, 1e-6, 1e-8}) {
    p.solver.rtol = rtol;
    const Hessian h = confirmed_hessian(p, rho);
    const double off = apart(p, h.matrix, expected);
    CAPTURE(rtol, off, h.error);
    // A third of what it changes by from rtol to a tenth of it; errors fall by 6.8 on the way, mostly.
    CHECK(off < 3 * h.error);
    CHECK(h.error < 1e3 * rtol);
  }
}

TEST_CASE("hessian bends: a damper of two branches") {
  agree(make_problem(
      Scene::parse(on_spring("damper_law = { kind = \"piecewise\", breaks = [0], coefficients = [[0, 1.0], [0, 3.0]] }",
                             kPath, "spring.s.damper_law.coefficients[0][1]"),
                   "branches.toml")));
}

TEST_CASE("hessian bends: a spring that stiffens") {
  agree(make_problem(Scene::parse(
      on_spring("spring_law = { kind = \"piecewise\", breaks = [0.1], coefficients = [[0, 40], [-6, 100]] }", kPath,
                ""),
      "stiffens.toml")));
}

TEST_CASE("hessian bends: a cost that bends with the force") {
  agree(make_problem(Scene::parse(on_spring("damper_law = { kind = \"piecewise\", breaks = [-0.5, 0.3], coefficients = "
                                            "[[-1, 0.5], [0, 2.5], [0.6, 0.5]] }",
                                            "[[cost.running]]\nkind = \"square\"\noutput = \"s.force\"\n"),
                                  "force.toml")));
}

TEST_CASE("hessian bends: tyres on roads of every kind") {
  for (const char* name : {"kinked_force_1", "kinked_force_2", "kinked_force_3"}) {
    INFO(name);
    Problem p = make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, name)));
    // The first derivative of the second scene is known to 3e3 rtol.
    if (name == std::string("kinked_force_2")) p.solver.rtol = 1e-9;
    agree(p);
  }
}
