// What samples hold. Accelerations and multipliers are solved for at the (q, v, z) of each sample, by the formulation's
// own equations, whatever the integrator interpolates: against a mechanism solved by hand, against a dense solution of
// the same equations, and at the kinks of a driver.
#include <fmt/format.h>
#include <support/models.h>
#include <support/variants.h>

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/level/penalty_weight.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;

namespace {

/// A crank of 0.3 m turned once in a second, a coupler of 0.9 m, a rocker of 0.8 m, a spring with a damper from the
/// ground to the rocker. Nothing is free to move, so that the motor's torque follows from the balance of power.
const char* const kCrankRocker = R"([gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.D]
ground = true
x_m = 1.0
y_m = 0

[point.B]
x_m = 0.0
y_m = 0.3

[point.C]
x_m = 0.7
y_m = 0.8

[bar.crank]
from = "A"
to = "B"
length_m = 0.3
mass_kg = 1

[bar.coupler]
from = "B"
to = "C"
length_m = 0.9
mass_kg = 2

[bar.rocker]
from = "C"
to = "D"
length_m = 0.8
mass_kg = 2

[angle.crank]
from = "A"
to = "B"

[driver.motor]
coordinate = "crank.angle"
law = { kind = "polynomial", coefficients = [0, 6.283185307179586] }

[spring.s]
from = "A"
to = "C"
stiffness_N_per_m = 200
natural_length_m = 1
damping_N_s_per_m = 10

[[cost.running]]
kind = "square"
output = "C.x"

[run]
t_end_s = 1
)";

/// The same by hand: the joints from the intersection of two circles, all rates from its derivative.
struct CrankRocker {
  double cx, cy, vx, vy;  // C and its velocity
  double energy;          // kinetic and potential
  double damping;         // power lost

  explicit CrankRocker(double t) {
    const double w = 6.283185307179586, bx = 0.3 * std::cos(w * t), by = 0.3 * std::sin(w * t);
    const double ux = -w * by, uy = w * bx;  // velocity of B
    const double dx = 1 - bx, dy = -by, d2 = dx * dx + dy * dy;
    const double s = (d2 + 0.81 - 0.64) / (2 * d2);  // along BD, in units of it
    const double h = std::sqrt(0.81 / d2 - s * s);   // across it
    cx = bx + s * dx - h * dy;
    cy = by + s * dy + h * dx;
    // (C - B).(C' - B') = 0, (C - D).C' = 0
    const double p = cx - bx, q = cy - by, r = cx - 1, det = p * cy - q * r, b = p * ux + q * uy;
    vx = b * cy / det;
    vy = -b * r / det;
    const double crank = 1.0 / 6 * (ux * ux + uy * uy);
    const double coupler = 2.0 / 6 * (ux * ux + uy * uy + ux * vx + uy * vy + vx * vx + vy * vy);
    const double rocker = 2.0 / 6 * (vx * vx + vy * vy);
    const double l = std::hypot(cx, cy), rate = (cx * vx + cy * vy) / l;
    energy = crank + coupler + rocker + 9.81 * (by / 2 + (by + cy) + cy) + 100 * (l - 1) * (l - 1);
    damping = 10 * rate * rate;
  }

  /// The multiplier of phi = angle - w t, minus the motor's torque: power = torque w = (energy)' + damping. The
  /// derivative by differences of order 6 with steps of 1 ms, good to some 1e-11 of its terms here.
  static double motor(double t) {
    const double h = 1e-3;
    const auto d = [&](int k) { return CrankRocker(t + k * h).energy - CrankRocker(t - k * h).energy; };
    return -((45 * d(1) - 9 * d(2) + d(3)) / (60 * h) + CrankRocker(t).damping) / 6.283185307179586;
  }
};

struct Way {
  std::string formulation, integrator;
};
std::vector<Way> ways() {
  std::vector<Way> all;
  for (const auto& f : formulations())
    for (const Integrator* i : integrators_of(f)) all.push_back({f.name, i->name});
  return all;
}

/// R1 and R2 of a sample with the formulation's own stabilization, each row relative to the sum of its terms' sizes.
double residual_of(const StateView& s, const System& system, const Stabilization& st) {
  Assembly x(system.assembly().mechanism_ptr(), system.parameters());
  x.calc_dynamics(s);
  const int n = x.n(), m = x.m();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n + m), size = sum;
  const auto add = [&](int row, double term) {
    sum[row] += term;
    size[row] += std::abs(term);
  };
  const auto each = [](const SparsePattern& p, const auto& visit) {
    for (int j = 0; j < p.cols; ++j)
      for (auto k = p.column_start[j]; k < p.column_start[j + 1]; ++k) visit(p.row[k], j, k);
  };
  each(x.square(), [&](int i, int j, auto k) { add(i, x.M[k] * s.a[j]); });
  each(x.jacobian(), [&](int i, int j, auto k) {
    add(j, x.phi_q[k] * s.lambda[i]);
    add(n + i, x.phi_q[k] * s.a[j]);
    add(n + i, 2 * st.xi * st.omega * x.phi_q[k] * s.v[j]);
  });
  for (int i = 0; i < n; ++i) add(i, -x.Q[i]);
  for (int i = 0; i < m; ++i) {
    add(n + i, x.bias[i] + 2 * st.xi * st.omega * x.phi_t[i] + st.omega * st.omega * x.phi[i]);
    add(n + i, -st.inverse_alpha * s.lambda[i]);
  }
  // Coordinates of which nothing moves have terms of rounding size alone.
  const double largest = size.maxCoeff();
  double worst = 0;
  for (int i = 0; i < n + m; ++i) worst = std::max(worst, std::abs(sum[i]) / std::max(size[i], 1e-3 * largest));
  return worst;
}

Stabilization stabilization_of(const Problem& p) {
  const FormulationOptions& o = p.formulation_options;
  if (p.formulation == "baumgarte") return {o.number("baumgarte_xi"), o.number("baumgarte_omega_rad_per_s"), 0};
  Stabilization s;
  if (p.formulation.starts_with("penalty") || p.formulation == "augmented-lagrangian")
    s = penalty_stabilization(p.mechanism, o);
  if (p.formulation == "augmented-lagrangian") s.inverse_alpha = 0;  // exact when it has converged
  return s;
}

struct Errors {
  double position = 0, velocity = 0, motor = 0;
};

/// The largest errors at samples that fall between steps, relative to the sizes of what is compared.
Errors errors_of(Problem problem, int count) {
  const int c = problem.mechanism->coordinate("C.x");
  int row = -1;
  const auto rows = problem.mechanism->row_names();
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i] == "driver.motor.drive") row = static_cast<int>(i);
  REQUIRE(row >= 0);
  std::vector<double> times;
  for (int i = 0; i <= count; ++i) times.push_back(static_cast<double>(i) / count);
  Errors e;
  simulate(problem, {}, times, [&](const MechanismState& s, System&) {
    const CrankRocker x(s.t);
    e.position = std::max(e.position, std::hypot(s.q[c] - x.cx, s.q[c + 1] - x.cy));
    e.velocity = std::max(e.velocity, std::hypot(s.v[c] - x.vx, s.v[c + 1] - x.vy) / 6);
    e.motor = std::max(e.motor, std::abs(s.lambda[row] - CrankRocker::motor(s.t)) / 12.4743);
  });
  return e;
}

}  // namespace

TEST_CASE("samples: a driven crank-rocker's motion and motor torque, every formulation and integrator") {
  // Steps keep rtol each, some 1e3 of them add up, and a multiplier follows velocities by a factor of a few: 1e4 rtol
  // of its size. What is interpolated and not solved for is off by 40 times its size at every tolerance.
  const Scene scene = Scene::parse(kCrankRocker, "crank_rocker.toml");
  for (const Way& way : ways()) {
    if (way.integrator == "fixed") continue;
    for (const double rtol : {1e-6, 1e-8, 1e-10}) {
      INFO(way.formulation << " on " << way.integrator << ", rtol " << rtol);
      Problem p = make_problem(scene, {});
      p.formulation = way.formulation;
      p.solver.integrator = way.integrator;
      p.solver.rtol = p.solver.atol = rtol;
      const Errors e = errors_of(p, 1000);
      CHECK(e.position <= 1e3 * rtol);
      CHECK(e.velocity <= 1e3 * rtol);
      CHECK(e.motor <= 1e4 * rtol);
    }
  }
}

TEST_CASE("samples: by fixed steps they are of second order or better, like the steps") {
  const Scene scene = Scene::parse(kCrankRocker, "crank_rocker.toml");
  Problem p = make_problem(scene, {});
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = 1.0 / 250;
  const Errors coarse = errors_of(p, 999);
  p.solver.step_s = 1.0 / 500;
  const Errors fine = errors_of(p, 999);
  // The differences of second order are a part (w h)^2 of the motion, w = 30 rad/s being the fastest that matters here.
  const double part = std::pow(30.0 / 500, 2);
  CHECK(fine.motor <= part);
  CHECK(fine.velocity <= part);
  CHECK(fine.position <= part);
  CHECK(coarse.motor / fine.motor >= 3.5);
}

TEST_CASE("samples: every formulation's accelerations and multipliers solve its own equations") {
  // To rounding, amplified by the condition of the mechanism. Redundant rows contradict each other by what they drift,
  // 100 rtol at most, which the augmented Lagrangian leaves in R2.
  const Scene redundant = Scene::load(COSTATE_MODELS_DIR "/bricard/bricard.toml");
  for (const Way& way : ways()) {
    std::vector<Problem> problems = {kitchen_sink_without_accelerations().problem(way.formulation, 1e-6)};
    if (find_formulation(way.formulation).carries_redundancy) {
      problems.push_back(make_problem(redundant, {}));
      problems.back().solver.t_end = 0.5;
    }
    for (Problem& p : problems) {
      INFO(way.formulation << " on " << way.integrator << ", " << p.mechanism->coordinate_count() << " coordinates");
      p.formulation = way.formulation;
      p.solver.integrator = way.integrator;
      if (way.integrator == "fixed") p.solver.step_s = 1.0 / 256;
      std::vector<double> times;
      for (int i = 0; i <= 37; ++i) times.push_back(p.solver.t_end * i / 37);
      double worst = 0;
      const auto rho = p.parameters.values();
      const Simulation stored = simulate(p, rho, times, [&](const MechanismState& s, System& system) {
        worst = std::max(worst, residual_of(s, system, stabilization_of(p)));
      });
      const bool drifts = p.mechanism == redundant.mechanism() && way.formulation == "augmented-lagrangian";
      CHECK(worst <= (drifts ? 100 * p.solver.rtol : 1e-10));
      // What is stored changes nothing of the run, which at most finds a matrix factored that a sample needed.
      const Simulation plain = simulate(p, rho, times);
      CHECK(stored.psi == Approx(plain.psi).epsilon(1e-12));
      CHECK(stored.counters.steps == plain.counters.steps);
      CHECK(stored.counters.residuals == plain.counters.residuals);
      // But Maggi's next positions are sought from those of the sample: there a start beyond the reach of the factors
      // at hand takes one factorization more.
      const std::size_t moved = way.formulation.starts_with("maggi") ? times.size() : 0;
      CHECK(stored.counters.factorizations <= plain.counters.factorizations + static_cast<long>(moved));
    }
  }
}

TEST_CASE("samples: exactly at a driver's kink they are the state behind it") {
  std::string text = kCrankRocker;
  const std::string law = R"({ kind = "polynomial", coefficients = [0, 6.283185307179586] })";
  text.replace(text.find(law), law.size(),
               R"({ kind = "piecewise", breaks = [0.25], coefficients = [[0, 1], [-0.5, 3]] })");
  const Scene scene = Scene::parse(text, "kink.toml");
  for (const auto& [formulation, integrator] :
       {std::pair("index1", "idas"), std::pair("index1", "cvodes"), std::pair("baumgarte", "idas"),
        std::pair("baumgarte", "cvodes"), std::pair("penalty", "idas"), std::pair("penalty", "cvodes"),
        std::pair("index2", "idas"), std::pair("baumgarte", "dopri5"), std::pair("maggi", "dop853")}) {
    INFO(formulation << " on " << integrator);
    Problem p = make_problem(scene, {});
    p.formulation = formulation;
    p.solver.integrator = integrator;
    std::vector<Eigen::VectorXd> at;
    const double behind = 1e-7;
    simulate(p, {}, {0.2, 0.25, 0.25 + behind}, [&](const MechanismState& s, System& system) {
      const int n = system.assembly().n(), m = system.assembly().m();
      Eigen::VectorXd x(2 * n + m);
      x << Eigen::Map<const Eigen::VectorXd>(s.v, n), Eigen::Map<const Eigen::VectorXd>(s.a, n),
          Eigen::Map<const Eigen::VectorXd>(s.lambda, m);
      at.push_back(x);
    });
    REQUIRE(at.size() == 3);
    // All rates are below 1e3 times the sizes, and rtol is 1e-8.
    CHECK((at[2] - at[1]).norm() <= 1e3 * behind * at[1].norm());
    CHECK((at[1] - at[0]).norm() > 0.1 * at[1].norm());
  }
}

TEST_CASE("samples: a cost at the end counts the multiplier that is solved for there") {
  std::string text = kCrankRocker;
  const std::string cost = "[[cost.running]]\nkind = \"square\"\noutput = \"C.x\"";
  text.replace(text.find(cost), cost.size(),
               "[[cost.terminal]]\nkind = \"square\"\noutput = \"lambda.driver.motor.drive\"");
  const Scene scene = Scene::parse(text, "end.toml");
  const double motor = CrankRocker::motor(0.948);
  for (const Way& way : ways()) {
    if (way.integrator == "fixed") continue;
    INFO(way.formulation << " on " << way.integrator);
    Problem p = make_problem(scene, {"spring.s.stiffness_N_per_m", "bar.coupler.mass_kg"});
    p.formulation = way.formulation;
    p.solver.integrator = way.integrator;
    p.solver.t_end = 0.948;  // the torque's peak
    // As for the samples: 1e4 rtol, twice for a square.
    CHECK(simulate(p, p.parameters.values()).psi == Approx(motor * motor).epsilon(2e4 * p.solver.rtol));
  }
  // And so do gradients: against the exact derivative by the spring's stiffness, torque w = d/dt (l - 1)^2 / 2.
  const CrankRocker at(0.948);
  const double l = std::hypot(at.cx, at.cy),
               by_stiffness = -(l - 1) * (at.cx * at.vx + at.cy * at.vy) / l / 6.283185307179586;
  for (const auto& [formulation, method] :
       {std::pair("index1", "idas-adjoint"), std::pair("index1", "idas-forward"), std::pair("index2", "idas-forward"),
        std::pair("index3", "idas-forward"), std::pair("baumgarte", "idas-adjoint"),
        std::pair("baumgarte", "cvodes-forward")}) {
    INFO(formulation << " by " << method);
    Problem p = make_problem(scene, {"spring.s.stiffness_N_per_m"});
    p.formulation = formulation;
    p.solver.t_end = 0.948;
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(r.gradient[0] == Approx(2 * motor * by_stiffness).epsilon(2e4 * p.solver.rtol));
  }
}
