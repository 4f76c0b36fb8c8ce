// Rimless wheels in steady rolling as limit cycles, against McGeer's closed form with an inertia about the hub: of six,
// eight and ten spokes, on four slopes.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "costate/cycle/cycle.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "support/paths.h"

using namespace costate;

namespace {

constexpr double kG = 9.81;

/// m = l = 1, inertia I about the hub, angles from the vertical: with a = pi/n, lambda = 1/(1 + I) and
/// eta = (cos 2a + I)/(1 + I), steady rolling has w+^2 = eta^2 (w+^2 + 4 g lambda sin a sin(slope)), and between
/// impacts w^2 = w+^2 + 2 g lambda (cos(slope - a) - cos(angle)).
template <class T>
struct Rolling {
  double a, lambda, eta;
  T slope, w2;  // just behind an impact
  Rolling(int n, double I, T slope_)
      : a(std::acos(-1.0) / n), lambda(1 / (1 + I)), eta((std::cos(2 * a) + I) / (1 + I)), slope(slope_) {
    using std::sin;
    w2 = eta * eta * 4 * kG * lambda * std::sin(a) * sin(slope) / (1 - eta * eta);
  }
  T rate(T angle) const {
    using std::cos, std::sqrt;
    return sqrt(w2 + 2 * kG * lambda * (cos(slope - a) - cos(angle)));
  }
  /// The time from spoke to spoke, by Simpson's rule: its error at 4,000 intervals is below 1e-13.
  T step_time() const {
    const int intervals = 4000;
    T sum = 0;
    for (int i = 0; i <= intervals; ++i) {
      const double weight = i == 0 || i == intervals ? 1 : i % 2 == 1 ? 4 : 2;
      sum += weight / rate(slope + a * (2.0 * i / intervals - 1));
    }
    return sum * (2 * a / intervals / 3);
  }
};

/// The wheel just before its standing spoke is upright. The section is the half turn's sine, which falls through zero
/// once a turn.
std::string wheel(int n, double slope, double I) {
  const Rolling<double> steady(n, I, slope);
  const double angle = 0.01, t = 2 * std::acos(-1.0) / n;
  std::string s =
      fmt::format(R"toml(
title = "wheel"
[gravity]
y_m_per_s2 = {}
[body.wheel]
x_m = {}
y_m = {}
angle_rad = {}
angular_velocity_rad_per_s = {}
mass_kg = 1
inertia_kg_m2 = {}
[start]
given = ["wheel.angle"]
[run]
t_end_s = {}
rtol = 1e-11
formulation = "index1"
method = "cvodes-adjoint"
[output.turn]
formula = "sin(angle)"
unit = "1"
angle = "wheel.angle"
[cycle]
turns = ["wheel.angle"]
section = {{ output = "turn", below = 0 }}
)toml",
                  -kG, -std::sin(angle), std::cos(angle), angle, -steady.rate(angle), I, 1.5 * n * steady.step_time());
  std::string numbers, factors;
  for (int i = 0; i < n; ++i) {
    s += fmt::format(R"(
[point.s{0}]
on = "wheel"
x_m = {1:.17g}
y_m = {2:.17g}
[contact.s{0}]
kind = "rigid"
point = "s{0}"
friction = "coulomb"
friction_coefficient = 3
ground_angle_rad = {3}
closed = {4}
along_m = 0
)",
                     i, std::sin(i * t), -std::cos(i * t), -slope, i == 0);
    numbers += fmt::format("\"contact.s{}.ground_angle_rad\",", i);
    factors += "-1,";
  }
  return s + fmt::format("[parameter.slope]\nnumbers = [{}]\nfactors = [{}]\n", numbers, factors);
}

}  // namespace

// The closed form without inertia, and its numbers by a program apart (40 digits).
TEST_CASE("rimless wheels: the closed form's own numbers", "[cycle]") {
  const auto meets = [](int n, double slope, double w, double time) {
    const Rolling<double> r(n, 0, slope);
    CHECK(std::abs(std::sqrt(r.w2) - w) <= 1e-14 * w);
    CHECK(std::abs(r.step_time() - time) <= 1e-12 * time);
  };
  meets(8, 0.08, 1.0954628396476568, 1.0345498114232793);
  meets(8, 0.2, 1.7272282958249288, 0.43036496151796070);
  meets(6, 0.2, 1.1398672832394569, 1.1406724913005559);
  meets(10, 0.05, 1.0714925537587702, 0.73701150005852010);
}

// A whole turn from behind one impact of a spoke to behind its next one: no other contact swaps roles, and the one that
// lets go is found.
TEST_CASE("rimless wheels: an impact as the section", "[cycle]") {
  constexpr int n = 6;
  const double slope = 0.2, I = 0.05;
  std::string text = wheel(n, slope, I);
  const std::string section = "section = { output = \"turn\", below = 0 }";
  text.replace(text.find(section), section.size(), "section = \"contact.s0 touch\"");
  const Scene scene = Scene::parse(text, "wheel.toml");
  Problem p = make_problem(scene, {"slope"});
  p.formulation = "baumgarte";
  const CycleResult r = find_cycle(p, *scene.cycle, p.parameters.values(), {});
  const Rolling<double> steady(n, I, slope);
  const double h = 1e-30;
  const Rolling<std::complex<double>> moved(n, I, std::complex<double>(slope, h));
  REQUIRE(r.names[1] == "wheel.angle_dot");
  CHECK(std::abs(std::remainder(r.x[0] - (steady.a - slope), 2 * std::acos(-1.0))) <= 1e-9);
  CHECK(std::abs(r.x[1] + std::sqrt(steady.w2)) <= 1e-8);
  CHECK(std::abs(r.x_rho(1, 0) + (std::sqrt(moved.w2)).imag() / h) <= 1e-6);
  CHECK(std::abs(r.period.value - n * steady.step_time()) <= 2e-9 * n);
  // The angle is the wheel's own; of the speed neither search is at rest to the last bit, and zero would be no error.
  CHECK(r.x_error[1] > 0);
  REQUIRE(!r.multipliers.empty());
  CHECK(std::abs(r.multipliers[0] - std::pow(steady.eta, 2 * n)) <= 1e-6);
}

// The fixed point to 1e-9, the time to 2e-9 a step, multipliers to 1e-6. A derivative of a time of some 10 s sums up
// sensitivities of all steps, each at rtol 1e-11 of what they grow to within a step (17 on the flattest slope, where
// the wheel nearly stops): 1e-7 of it. All multipliers are eta^2n, whatever the slope: their derivative is zero, and
// said to be known no better than it is.
TEST_CASE("rimless wheels: four cases as limit cycles", "[cycle]") {
  for (const auto& [n, slope] : {std::pair{8, 0.08}, {8, 0.2}, {6, 0.2}, {10, 0.05}})
    for (const double I : {1e-4, 0.05}) {
      CAPTURE(n, slope, I);
      const Scene scene = Scene::parse(wheel(n, slope, I), "wheel.toml");
      Problem p = make_problem(scene, {"slope"});
      p.solver.integrator = "cvodes";
      CycleOptions once;
      once.estimate = false;
      once.multiplier = n == 6;
      const CycleResult r = find_cycle(p, *scene.cycle, p.parameters.values(), once);
      const Rolling<double> steady(n, I, slope);
      const double h = 1e-30;
      const Rolling<std::complex<double>> moved(n, I, std::complex<double>(slope, h));
      const double time_by_slope = n * moved.step_time().imag() / h;
      REQUIRE(r.names[1] == "wheel.angle_dot");
      CHECK(std::abs(r.x[1] + steady.rate(0)) <= 1e-9);
      CHECK(std::abs(r.period.value - n * steady.step_time()) <= 2e-9 * n);
      CHECK(std::abs(r.period_rho[0] - time_by_slope) <= 1e-7 * std::abs(time_by_slope));
      CHECK(std::abs(r.multipliers[0] - std::pow(steady.eta, 2 * n)) <= 1e-6);
      CHECK(r.stable() == true);
      CHECK(std::count_if(r.events.begin(), r.events.end(),
                          [](const RunEvent& e) { return e.name.find("touch") != std::string::npos; }) == n);
      if (once.multiplier) {
        REQUIRE(r.multiplier_rho.size() == 1);
        CHECK(std::abs(r.multiplier_rho[0]) <= r.multiplier_rho_error[0]);
      }
    }
}

TEST_CASE("rimless wheels: the shipped wheel's whole turn", "[cycle]") {
  const Scene scene = Scene::load(COSTATE_MODELS_DIR "/rimless_wheel/whole_turn.toml");
  Problem p = make_problem(scene);
  p.solver.integrator = "cvodes";
  const CycleResult r = find_cycle(p, *scene.cycle, p.parameters.values());
  const Rolling<double> steady(8, 1e-6, 0.08);
  CHECK(std::abs(r.period.value - 8 * steady.step_time()) <= 3 * r.period.error + 1e-8);
  CHECK(std::abs(r.x[1] + steady.rate(0)) <= 3 * r.x_error[1] + 1e-9);
}
