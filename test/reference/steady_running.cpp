// Steady running as cycles: an engine under the pressure of its gas, against the energy of its one freedom, and the
// vehicle on sinusoidal posts, against what it settles to by itself.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/cycle/cycle.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "support/paths.h"

using namespace costate;

namespace {

const std::string kModels = COSTATE_MODELS_DIR "/";
const double kPi = std::acos(-1.0);

/// The engine of models/engine as one freedom: E = J(angle) w^2/2 changes by dE/d(angle) = Q(angle) - c w, with all
/// numbers of the scene written once more.
class Engine {
 public:
  double fuel = 2e6, load = 0.15, flywheel = 0.4;

  /// rate [rad/s] and time [s] where they end; decay: the integral of c/J over the time.
  struct Turns {
    double rate, time, decay;
  };
  /// Two turns from the firing dead centre on, by Runge-Kutta steps of fourth order in the angle.
  Turns two_turns(double rate) const {
    double E = 0.5 * moment(0) * rate * rate, t = 0, decay = 0;
    constexpr int kSteps = 10000;
    const double h = 4 * kPi / kSteps;
    const auto w = [&](double angle, double energy) { return std::sqrt(2 * energy / moment(angle)); };
    for (int i = 0; i < kSteps; ++i) {
      const double a = i * h, b = a + h / 2, c = a + h;
      const auto slope = [&](double angle, double energy) { return torque(angle) - load * w(angle, energy); };
      const double k1 = slope(a, E), k2 = slope(b, E + h / 2 * k1), k3 = slope(b, E + h / 2 * k2),
                   k4 = slope(c, E + h * k3);
      const double next = E + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      const double at_a = 1 / w(a, E), at_b = 2 / w(b, E + h / 2 * k1) + 2 / w(b, E + h / 2 * k2),
                   at_c = 1 / w(c, next);
      t += h / 6 * (at_a + at_b + at_c);
      decay += h / 6 * load * (at_a / moment(a) + at_b / moment(b) + at_c / moment(c));
      E = next;
    }
    return {w(0, E), t, decay};
  }
  /// At the rate that two turns bring back, by secants.
  Turns steady() const {
    double a = 60, b = 80, fa = two_turns(a).rate - a, fb = two_turns(b).rate - b;
    for (int i = 0; i < 20 && std::abs(fb) > 1e-13 * b && fb != fa; ++i) {
      const double c = b - fb * (b - a) / (fb - fa);
      a = b, fa = fb;
      b = c, fb = two_turns(b).rate - b;
    }
    return two_turns(b);
  }
  /// A change of E decays by dE' = -c dw/dE dE = -c/(J w) dE per angle.
  double multiplier() const { return std::exp(-steady().decay); }

 private:
  static constexpr double kCrank = 0.04, kRod = 0.14;

  static double quintic(double s) {
    if (s <= 0) return 0;
    if (s >= 1) return 1;
    return s * s * s * (10 + s * (-15 + 6 * s));
  }
  static double burnt(double s) {
    const double x[] = {-0.1, 0.02, 0.15, 0.3}, y[] = {0, 0.3, 0.85, 1};
    double r = y[0];
    for (int i = 0; i < 3; ++i) r += (y[i + 1] - y[i]) * quintic((s - x[i]) / (x[i + 1] - x[i]));
    return r;
  }
  double moment(double angle) const {
    const double sin_b = kCrank * std::sin(angle) / kRod, cos_b = std::sqrt(1 - sin_b * sin_b);
    const double b_by = kCrank * std::cos(angle) / (kRod * cos_b);  // the rod's angle by the crank's
    const double pin = -kCrank * std::sin(angle) - kRod * sin_b * b_by;
    const double x = -kCrank * std::sin(angle) - 0.04 * sin_b * b_by;  // the rod's centre, 0.04 m from the crank pin
    const double y = kCrank * std::cos(angle) - 0.04 * cos_b * b_by;
    return flywheel + 0.5 * pin * pin + 0.4 * (x * x + y * y) + 0.0012 * b_by * b_by;
  }
  double torque(double angle) const {
    const double sin_b = kCrank * std::sin(angle) / kRod, cos_b = std::sqrt(1 - sin_b * sin_b);
    const double x = kCrank * std::cos(angle) + kRod * cos_b;
    const double pin = -kCrank * std::sin(angle) - kRod * sin_b * kCrank * std::cos(angle) / (kRod * cos_b);
    const double pressure =
        (1e5 * std::pow(9.0, 1.3) + fuel * burnt(std::sin(angle / 2))) / std::pow(1 + 8 * (0.18 - x) / 0.08, 1.3) - 1e5;
    return -0.005 * quintic(std::cos(angle / 2) / 0.25) * pressure * pin;
  }
};

}  // namespace

// Both at errors of some 1e-9: rtol 1e-10 over 1,500 steps and two integrators, fourth order of 10,000 steps.
TEST_CASE("steady running: an engine's two turns", "[cycle]") {
  const Scene scene = Scene::load(kModels + "engine/engine.toml");
  Problem p = make_problem(scene);
  const std::vector<double> rho = p.parameters.values();
  CycleOptions with;
  with.multiplier = true;
  const CycleResult r = find_cycle(p, *scene.cycle, rho, with);
  const Engine engine;
  const auto [rate, time, decay] = engine.steady();
  REQUIRE(r.names.size() == 2);
  CHECK(std::abs(r.x[1] - rate) <= 1e-8 * rate);
  CHECK(std::abs(r.period.value - time) <= 1e-8 * time);
  REQUIRE(r.multipliers.size() == 1);
  CHECK(std::abs(r.multipliers[0] - std::exp(-decay)) <= 1e-8);
  CHECK(r.stable() == true);
  // Derivatives by fuel, load and flywheel: differences over 4, 2 and 1 % of each, extrapolated, are good to 1e-7 of
  // them.
  double Engine::*const parts[] = {&Engine::fuel, &Engine::load, &Engine::flywheel};
  for (int j = 0; j < 3; ++j) {
    CAPTURE(j);
    const auto by = [&](const auto& of) {
      double a[3];
      for (int k = 0; k < 3; ++k) {
        Engine more, less;
        const double h = 0.04 / (1 << k) * rho[static_cast<std::size_t>(j)];
        more.*parts[j] += h;
        less.*parts[j] -= h;
        a[k] = (of(more) - of(less)) / (2 * h);
      }
      const double b0 = (4 * a[1] - a[0]) / 3, b1 = (4 * a[2] - a[1]) / 3;
      return (16 * b1 - b0) / 15;
    };
    const double of_time = by([](const Engine& e) { return e.steady().time; });
    const double of_multiplier = by([](const Engine& e) { return e.multiplier(); });
    // The time itself is known to 1e-8, and depends little on the flywheel.
    const double known = 1e-8 * time / rho[static_cast<std::size_t>(j)];
    CHECK(std::abs(r.period_rho[j] - of_time) <= 1e-6 * std::abs(of_time) + known);
    CHECK(std::abs(r.multiplier_rho[j] - of_multiplier) <= 1e-6 * std::abs(of_multiplier));
    CHECK(r.multiplier_rho_error[j] <= 1e-6 * std::abs(of_multiplier));
  }
}

// Four strokes are two turns. One turn on, another stroke begins, which no accelerations at a dead centre tell.
TEST_CASE("steady running: one turn of four strokes is no cycle", "[cycle]") {
  const auto found = [](const std::vector<std::string>& overrides) {
    const Scene scene = Scene::load(kModels + "engine/engine.toml", overrides);
    CycleOptions once;
    once.estimate = once.derivatives = false;
    const Problem p = make_problem(scene);
    return find_cycle(p, *scene.cycle, p.parameters.values(), once);
  };
  const std::string each_turn = "output.half_turn.formula='sin(angle)'";
  // Written as if every turn were alike it has a fixed point, of 262 rad/s.
  try {
    found({each_turn});
    FAIL("a cycle of one turn was found");
  } catch (const ModelError& e) {
    CHECK(std::string(e.what()).find("'crank.angle' by 6.28319 rad") != std::string::npos);
  }
  // What turns backwards meets the section at other strokes.
  CHECK_THROWS_AS(found({"body.crank.inertia_kg_m2=0.05", "body.crank.angular_velocity_rad_per_s=150"}), ModelError);
  const CycleResult whole = found({}), counted = found({each_turn, "cycle.count=2"});
  CHECK(std::abs(counted.period.value - whole.period.value) <= 1e-8 * whole.period.value);
  CHECK(std::abs(counted.multipliers[0] - whole.multipliers[0]) <= 1e-7);
}

// The largest multiplier is 0.095: after twelve periods from rest 1e-12 is left of what the start was off by. Two runs
// at rtol 1e-8 are some hundred tolerances apart.
TEST_CASE("steady running: the vehicle on sinusoidal posts", "[cycle]") {
  const Scene scene = Scene::load(kModels + "iltis/sine_posts.toml");
  Problem p = make_problem(scene);
  CycleOptions once;
  once.estimate = once.derivatives = false;
  const CycleResult r = find_cycle(p, *scene.cycle, p.parameters.values(), once);
  CHECK(r.stable() == true);
  CHECK(std::abs(r.largest() - 0.0952554) <= 1e-5);
  Problem long_run = p;
  long_run.cycle.reset();
  long_run.solver.t_end = 12 * r.period.value;
  const auto n = static_cast<std::size_t>(p.mechanism->coordinate_count());
  bool seen = false;
  simulate(long_run, p.parameters.values(), {long_run.solver.t_end}, [&](const MechanismState& s, System&) {
    seen = true;
    for (std::size_t i = 0; i < n; ++i) {
      CAPTURE(r.state_names[i]);
      CHECK(std::abs(s.q[i] - r.state[i]) <= 1e-6);
      CHECK(std::abs(s.v[i] - r.state[n + i]) <= 1e-5);
    }
  });
  CHECK(seen);
}
