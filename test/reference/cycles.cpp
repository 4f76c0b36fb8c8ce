// Limit cycles and periodic motions against what is known of them without this project: closed forms, and numbers of
// small programs of their own.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/cycle/cycle.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {

using Complex = std::complex<double>;
const std::string kCycles = COSTATE_MODELS_DIR "/cycles/";

struct Found {
  Scene scene;
  Problem problem;
  CycleResult r;
};

Found found(const std::string& file, const std::vector<std::string>& overrides = {},
            const std::string& formulation = {}, const std::string& integrator = {}) {
  const Scene scene = Scene::load(file, overrides);
  Problem p = make_problem(scene);
  if (!formulation.empty()) p.formulation = formulation;
  p.solver.integrator = integrator;
  return {scene, p, find_cycle(p, *scene.cycle, p.parameters.values())};
}

/// The steady motion of J a + c v + k q = A sin(w t + phase): angle and rate at t = 0, psi = integral of 0.15 v^2.
struct Steady {
  double angle, rate, psi;
};
Steady oscillator(double k, double c, double J, double A) {
  const double w = std::acos(-1.0), phase = 0.4, T = 2;
  const Complex X = A * std::exp(Complex(0, phase)) / Complex(k - J * w * w, c * w);
  return {X.imag(), (Complex(0, w) * X).imag(), 0.15 * w * w * std::norm(X) / 2 * T};
}

}  // namespace

// Closed form; derivatives of it by complex steps would be the same, central differences of it are good to 1e-9. The
// run is at rtol 1e-9 and amplifies nothing (multipliers of 0.55): some 100 tolerances.
TEST_CASE("cycle: a forced linear oscillator", "[cycle]") {
  const double k = 8, c = 0.3, J = 0.5, A = 1.2;
  const Steady exact = oscillator(k, c, J, A);
  for (const auto& [formulation, integrator] : {std::pair{"baumgarte", "idas"},
                                                {"baumgarte", "cvodes"},
                                                {"index1", "cvodes"},
                                                {"index2", "idas"},
                                                {"maggi", "cvodes"}}) {
    CAPTURE(formulation, integrator);
    const CycleResult r = found(kCycles + "forced_oscillator.toml", {}, formulation, integrator).r;
    CHECK(r.period.value == 2);
    CHECK(std::abs(r.x[0] - exact.angle) <= 1e-7);
    CHECK(std::abs(r.x[1] - exact.rate) <= 1e-7);
    CHECK(std::abs(r.psi.value - exact.psi) <= 1e-7);
    const double z = c / (2 * J);
    const Complex m = std::exp(Complex(-z, std::sqrt(k / J - z * z)) * 2.0);
    REQUIRE(r.multipliers.size() == 2);
    CHECK(std::abs(r.multipliers[0] - Complex(m.real(), std::abs(m.imag()))) <= 1e-7);
    CHECK(r.multipliers[1] == std::conj(r.multipliers[0]));
    CHECK(r.stable() == true);
    for (int j = 0; j < 4; ++j) {
      double up[4] = {k, c, J, A}, down[4] = {k, c, J, A};
      const double h = 1e-4 * up[j];
      up[j] += h;
      down[j] -= h;
      const Steady a = oscillator(up[0], up[1], up[2], up[3]), b = oscillator(down[0], down[1], down[2], down[3]);
      CHECK(std::abs(r.x_rho(0, j) - (a.angle - b.angle) / (2 * h)) <= 1e-6);
      CHECK(std::abs(r.x_rho(1, j) - (a.rate - b.rate) / (2 * h)) <= 1e-6);
      CHECK(std::abs(r.psi_rho[j] - (a.psi - b.psi) / (2 * h)) <= 1e-6);
      CHECK(r.period_rho[j] == 0);
    }
  }
}

// Numbers of a program of its own: Runge and Kutta's method with 8000 steps a period, with the variational equations
// and Newton; 4000 steps change the last two digits. Derivatives: fourth-order differences of the same.
TEST_CASE("cycle: a forced pendulum", "[cycle]") {
  const CycleResult r = found(kCycles + "forced_pendulum.toml").r;
  CHECK(std::abs(r.x[0] + 0.35896729487) <= 1e-7);
  CHECK(std::abs(r.x[1] + 2.69097026072) <= 1e-6);
  CHECK(std::abs(r.psi.value - 0.25978896609) <= 1e-7);
  REQUIRE(r.multipliers.size() == 2);
  CHECK(std::abs(r.multipliers[0] - Complex(-0.00615409385, 0.43855314682)) <= 1e-6);
  const double x_rho[2][3] = {{0.16413747155, -0.26412432346, -0.08219613469},
                              {0.33309358513, 2.71996746469, -0.72459372695}},
               psi_rho[3] = {-0.11882633339, -0.24017491898, 0.13339832711};
  for (int j = 0; j < 3; ++j) {
    CHECK(std::abs(r.x_rho(0, j) - x_rho[0][j]) <= 1e-6);
    CHECK(std::abs(r.x_rho(1, j) - x_rho[1][j]) <= 1e-5);
    CHECK(std::abs(r.psi_rho[j] - psi_rho[j]) <= 1e-6);
  }
  // Estimates tell the size of what is off.
  CHECK(std::abs(r.x[0] + 0.35896729487) <= 10 * r.x_error[0] + 1e-9);
}

// The velocity obeys van der Pol's equation with mu = 1, whose period 6.6632868593231... is in the literature. The
// multiplier is exp of the integral of 1 - v^2; it, psi and the derivatives are numbers of the same kind of program.
TEST_CASE("cycle: Rayleigh's oscillator, a section by a crossing", "[cycle]") {
  for (const char* formulation : {"baumgarte", "maggi"}) {
    CAPTURE(formulation);
    const CycleResult r = found(kCycles + "rayleigh.toml", {}, formulation).r;
    CHECK(std::abs(r.period.value - 6.6632868593231) <= 1e-7);
    CHECK(std::abs(r.x[0]) <= 1e-12);
    CHECK(std::abs(r.x[1] - 1.9192758356) <= 1e-7);
    CHECK(std::abs(r.psi.value - 15.2358414448) <= 1e-6);
    REQUIRE(r.multipliers.size() == 1);
    CHECK(std::abs(r.multipliers[0] - 0.00085969506) <= 1e-7);
    // The parameter is the coefficient -mu.
    CHECK(std::abs(r.period_rho[0] + 0.73159659781) <= 1e-5);
    CHECK(std::abs(r.period_rho[1] + 3.69744172839) <= 1e-5);
    CHECK(std::abs(r.psi_rho[0] + 20.7201877569) <= 1e-4);
    CHECK(std::abs(r.psi_rho[1] + 25.5959353195) <= 1e-4);
    CHECK(std::abs(r.x_rho(1, 0) + 0.83337431167) <= 1e-5);
    CHECK(std::abs(r.x_rho(1, 1) - 0.06313180307) <= 1e-5);
  }
}

// Stated errors of derivatives are those of the search at the tolerance; what is stored comes from that at a tenth.
// Against the numbers above: within twice the stated, which itself is no more than some 1e4 tolerances of it (it is 600
// at most). Without the search before there are none.
TEST_CASE("cycle: derivatives say what they are within", "[cycle]") {
  for (const double rtol : {1e-4, 1e-6, 1e-8})
    for (const char* formulation : {"baumgarte", "index1", "maggi"}) {
      const std::vector<std::string> at = {fmt::format("run.rtol={}", rtol), fmt::format("run.atol={}", rtol)};
      CAPTURE(rtol, formulation);
      const auto within = [&](const Eigen::VectorXd& by, const Eigen::VectorXd& error, std::vector<double> exact) {
        REQUIRE(error.size() == by.size());
        double size = 0;
        for (const double e : exact) size = std::max(size, std::abs(e));
        for (std::size_t j = 0; j < exact.size(); ++j) {
          const auto k = static_cast<Eigen::Index>(j);
          CAPTURE(j, by[k], exact[j], error[k]);
          CHECK(std::abs(by[k] - exact[j]) <= 2 * error[k] + 1e-9);
          CHECK(error[k] <= 1e4 * rtol * size);
        }
      };
      const CycleResult rayleigh = found(kCycles + "rayleigh.toml", at, formulation).r;
      within(rayleigh.period_rho, rayleigh.period_rho_error, {-0.73159659781, -3.69744172839});
      within(rayleigh.psi_rho, rayleigh.psi_rho_error, {-20.7201877569, -25.5959353195});
      within(rayleigh.x_rho.row(1), rayleigh.x_rho_error.row(1), {-0.83337431167, 0.06313180307});
      const CycleResult pendulum = found(kCycles + "forced_pendulum.toml", at, formulation).r;
      within(pendulum.psi_rho, pendulum.psi_rho_error, {-0.11882633339, -0.24017491898, 0.13339832711});
      within(pendulum.x_rho.row(0), pendulum.x_rho_error.row(0), {0.16413747155, -0.26412432346, -0.08219613469});
    }
  const Scene scene = Scene::load(kCycles + "rayleigh.toml");
  CycleOptions alone;
  alone.estimate = false;
  const Problem p = make_problem(scene);
  CHECK(find_cycle(p, *scene.cycle, p.parameters.values(), alone).psi_rho_error.size() == 0);
}

// x'' + c x' + x = c cos t, c = 0.005: x = sin t, psi = pi. At rtol 1e-8 on IDAS the searches at the tolerance and at a
// tenth come within 8e-9 of each other, 2e-7 from it: the third one tells.
TEST_CASE("cycle: stated errors where two searches agree by chance", "[cycle]") {
  const Scene scene = Scene::parse(R"toml([point.P]
x_m = 0.0
vx_m_per_s = 1.0
y_m = 0
[mass.P]
point = "P"
mass_kg = 1.0
[driver.y]
coordinate = "P.y"
law = 0.0
[force.f]
point = "P"
formula_x_N = "a*cos(t) - k*P.x - c*P.x_dot"
a = 0.005
k = 1.0
c = 0.005
[start]
given = ["P.x"]
[run]
t_end_s = 10.0
parameters = ["force.f.k", "force.f.c", "force.f.a"]
[[cost.running]]
kind = "square"
output = "P.x"
[cycle]
period_s = 6.283185307179586
)toml",
                                   "resonance.toml");
  Problem p = make_problem(scene);
  p.solver.integrator = "idas";
  const double pi = std::acos(-1.0);
  for (const double rtol : {1e-6, 1e-7, 3e-8, 1e-8, 1e-9}) {
    CAPTURE(rtol);
    p.solver.set_rtol(rtol);
    const CycleResult r = find_cycle(p, *scene.cycle, p.parameters.values());
    CHECK(std::abs(r.x[1] - 1) <= 4 * r.x_error[1]);
    CHECK(std::abs(r.psi.value - pi) <= 4 * r.psi.error);
    // psi = pi A^2, A = a/c at k = 1.
    CHECK(std::abs(r.psi_rho[1] + 2 * pi / 0.005) <= 4 * r.psi_rho_error[1]);
    CHECK(std::abs(r.psi_rho[2] - 2 * pi / 0.005) <= 4 * r.psi_rho_error[2]);
    CHECK(std::abs(r.psi_rho[0]) <= 4 * r.psi_rho_error[0]);
  }
}

// Twice around is a cycle, too, with the squares of the multipliers.
TEST_CASE("cycle: a section met twice", "[cycle]") {
  const CycleResult r =
      found(kCycles + "rayleigh.toml",
            {"cycle.count=2", "torsion_spring.shaft.damper_law.coefficients=[0, -0.2, 0, 0.0666666666666667]"})
          .r;
  const CycleResult once = found(kCycles + "rayleigh.toml",
                                 {"torsion_spring.shaft.damper_law.coefficients=[0, -0.2, 0, 0.0666666666666667]"})
                               .r;
  CHECK(std::abs(r.period.value - 2 * once.period.value) <= 1e-6);
  CHECK(std::abs(r.psi.value - 2 * once.psi.value) <= 1e-5);
  CHECK(std::abs(r.multipliers[0] - once.multipliers[0] * once.multipliers[0]) <= 1e-6);
  for (int j = 0; j < 2; ++j) CHECK(std::abs(r.period_rho[j] - 2 * once.period_rho[j]) <= 1e-5);
}

// The scene's own psi, that of the cycle: its gradient by forward sensitivities, by one more adjoint run and by
// hand-derived equations, against the same numbers; differences rerun the whole search.
TEST_CASE("cycle: gradients on the cycle by every kind of method", "[cycle]") {
  const Scene scene = Scene::load(kCycles + "forced_pendulum.toml", {"run.cycle=true"});
  Problem p = make_problem(scene);
  REQUIRE(p.cycle);
  const double exact[3] = {-0.11882633339, -0.24017491898, 0.13339832711};
  for (const char* method : {"idas-forward", "cvodes-forward", "hand-tangent", "idas-adjoint", "cvodes-adjoint",
                             "hand-adjoint", "differences"}) {
    CAPTURE(method);
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(std::abs(r.psi - 0.25978896609) <= 1e-7);
    for (int j = 0; j < 3; ++j) CHECK(std::abs(r.gradient[static_cast<std::size_t>(j)] - exact[j]) <= 1e-6);
  }
  CHECK_THROWS_WITH(gradient(p, "discrete-adjoint", p.parameters.values()), Catch::Contains("discrete"));
  const Scene free = Scene::load(kCycles + "rayleigh.toml", {"run.cycle=true"});
  const Problem q = make_problem(free);
  for (const char* method : {"idas-adjoint", "cvodes-adjoint", "cvodes-forward"}) {
    CAPTURE(method);
    const GradientResult r = gradient(q, method, q.parameters.values());
    CHECK(std::abs(r.psi - 15.2358414448) <= 1e-6);
    CHECK(std::abs(r.gradient[0] + 20.7201877569) <= 1e-4);
    CHECK(std::abs(r.gradient[1] + 25.5959353195) <= 1e-4);
  }
  CHECK_THROWS_WITH(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml", {"run.cycle=true"}),
                    Catch::Contains("is that of a table [cycle], which is missing"));
}

// A short blow once a period is all that depends on time: x'' + 0.6 x' + 16 x = 2 f with f = e^(k (cos(pi (t - 0.3)) -
// 1)) of a Gaussian's width sigma = 1/(pi sqrt(k)) = 3.2 ms. As an impulse: v jumps by J = 2 sqrt(2 pi) sigma, and
// motions behind it are multiplied by e^(s^2 sigma^2 / 2); the Gaussian is off by 1/(8 k) = 1.25e-5 of it, and 1 % of
// s^2 sigma^2 is less. The run is at rtol 1e-9.
TEST_CASE("cycle: a short blow once a period", "[cycle]") {
  const Scene scene =
      Scene::load(kCycles + "forced_oscillator.toml",
                  {"couple.drive.torque_N_m={kind='formula', formula='exp(k*(cos(pi*(t - 0.3)) - 1))', k=1e4}",
                   "parameter.amplitude.number=couple.drive.torque_N_m.k", "run.parameters=['stiffness']"});
  const Problem p = make_problem(scene);
  const CycleResult r = find_cycle(p, *scene.cycle, p.parameters.values());
  const double pi = std::acos(-1.0), k = 1e4, sigma = 1 / (pi * std::sqrt(k)), J = 2 * std::sqrt(2 * pi) * sigma;
  const Complex s(-0.3, std::sqrt(16 - 0.09));
  // Of blows at 0.3 s and all that were before, at the period's end: the imaginary part.
  const Complex sum = J / s.imag() * std::exp(s * (2 - 0.3) + 0.5 * s * s * sigma * sigma) / (1.0 - std::exp(2.0 * s));
  CHECK(std::abs(r.x[0] - sum.imag()) <= 3e-5 * std::abs(sum));
  CHECK(std::abs(r.x[1] - (s * sum).imag()) <= 3e-5 * std::abs(s * sum));
}

// What is no cycle is refused by name.
TEST_CASE("cycle: refusals", "[cycle]") {
  using Catch::Contains;
  const auto says = [](const std::string& file, const std::vector<std::string>& overrides, const std::string& text) {
    CAPTURE(text);
    CHECK_THROWS_WITH(found(file, overrides), Contains(text));
  };
  const std::string forced = kCycles + "forced_oscillator.toml", rayleigh = kCycles + "rayleigh.toml",
                    walker = COSTATE_MODELS_DIR "/walker/arc_feet.toml";
  says(forced, {"cycle.period_s=1.9"}, "this is no period of theirs");
  says(forced, {"couple.drive.torque_N_m.amplitude=0"}, "Nothing here depends on time");
  says(forced, {"parameter.w.number=couple.drive.torque_N_m.angular_frequency_rad_per_s", "run.parameters=['w']"},
       "changes the period of the forces");
  // A pulse between two looks at forces that are far apart, and no other force.
  const std::string once = "couple.drive.torque_N_m={kind='bump', height_m=1, start_m=0.30, length_m=0.01}",
                    its = "parameter.amplitude.number=couple.drive.torque_N_m.height_m";
  says(forced, {once, its}, "this is no period of theirs");
  says(forced, {once, its, "cycle={section={output='disk.angle', above=0}}"}, "Give 'period_s'");
  says(forced, {"cycle.section=spring touch"}, "found both");
  says(rayleigh, {"cycle={section='contact.foot touch'}"}, "There is no event 'contact.foot touch'");
  says(rayleigh, {"cycle.section.above=5"}, "never comes");
  // Without damping a whole family of motions closes: energy stays as it is.
  says(rayleigh, {"torsion_spring.shaft.damper_law.coefficients=[0, 0, 0, 0]"}, "A cycle is not determined");
  says(walker, {"cycle.section=contact.foot touch"}, "There is no event 'contact.foot touch'");
  says(walker, {"cycle.travel=hip.x"}, "is no position that [start] gives");
  says(walker, {"cycle.relabel.right=middle"}, "second partner");
  says(walker,
       {"body.right.mass_kg=0.6", "run.parameters=['slope']", "parameter.leg_mass.numbers=['body.left.mass_kg']"},
       "swap roles, and differ");
  // Coordinates alone come back: no column says what a contact is.
  says(COSTATE_SOURCE_DIR "/test/cases/slides_at_the_end.toml", {}, "contact.floor is sliding at the end of a cycle");
}
