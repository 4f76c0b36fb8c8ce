// Explicit Runge-Kutta schemes: the orders that their tables have, and exact derivatives of the steps that a run took.
// What is asked of them, and to what tolerances: runge_kutta_gradients.h.
#include <support/models.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/discrete/explicit_step.h"
#include "costate/integrator/runge_kutta_run.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "runge_kutta_gradients.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

/// y0' = y1, y1' = -y0 + sin(t) y0^2 and psi' = y0 y1: not linear, not autonomous.
void rates(double t, const double* y, double* k, bool cost) {
  k[0] = y[1];
  k[1] = -y[0] + std::sin(t) * y[0] * y[0];
  if (cost) k[2] = y[0] * y[1];
}

/// At t = 1, by n equal steps; `within` gives the state at that part of the last step.
std::array<double, 3> solve(const ExplicitScheme& scheme, int n, double within = 1) {
  ExplicitStep step(scheme, 2, true, rates);
  std::array<double, 3> y = {1, 0.3, 0};
  step.begin(0, y.data());
  for (int i = 0; i < n; ++i) {
    if (i > 0) step.go_on();
    step.attempt(1.0 / n, (i + 1.0) / n);
  }
  if (within < 1)
    step.dense(within, y.data());
  else
    std::copy(step.end(), step.end() + 3, y.begin());
  return y;
}

double apart(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double d = 0;
  for (int i = 0; i < 3; ++i) d = std::max(d, std::abs(a[i] - b[i]));
  return d;
}

/// psi over the steps that a run at the problem's own parameters takes.
class HeldSteps {
 public:
  explicit HeldSteps(const Problem& problem) : problem_(problem), system_(problem.make_ode()) {
    const auto rho = problem.parameters.values();
    system_->set_parameters(rho.data());
    ExplicitRun run(*system_, problem.solver, {}, StartDerivative::none);
    scheme_ = &run.scheme();
    run.follow({[&](const ExplicitStages& s) { steps_.push_back(s); }, {}});
    run.advance(problem.solver.t_end);
    REQUIRE(run.counters().jumps == 0);
  }
  double psi(const std::vector<double>& rho) {
    system_->set_parameters(rho.data());
    const bool cost = system_->has_running_cost();
    ExplicitStep step(*scheme_, system_->size(), cost, [&](double t, const double* y, double* k, bool with) {
      system_->rhs(t, y, k);
      if (with) k[system_->size()] = system_->running_cost(t, y);
    });
    std::vector<double> y(static_cast<std::size_t>(step.size()), 0);
    system_->start(problem_.solver.t_start, y.data(), nullptr);
    for (const ExplicitStages& s : steps_) {
      step.repeat(s.t, y.data(), s.h, s.t_end);
      std::copy(step.end(), step.end() + step.size(), y.begin());
    }
    return (cost ? y.back() : 0) + system_->terminal_cost(problem_.solver.t_end, y.data());
  }

 private:
  const Problem& problem_;
  std::unique_ptr<OdeSystem> system_;
  const ExplicitScheme* scheme_ = nullptr;
  std::vector<ExplicitStages> steps_;
};

std::vector<std::string> with_right_hand_side() {
  std::vector<std::string> r;
  for (const auto& f : formulations())
    if (f.make_ode) r.push_back(f.name);
  return r;
}

std::vector<std::string> explicit_names() {
  std::vector<std::string> r;
  for (const auto& s : explicit_schemes()) r.push_back(s.name);
  return r;
}

}  // namespace

TEST_CASE("explicit schemes: each row evaluates where its sum says") {
  REQUIRE(explicit_schemes().size() == 2);
  for (const auto& s : explicit_schemes())
    for (std::size_t i = 0; i < s.a.size(); ++i) {
      double sum = 0, size = 1;
      for (const double a : s.a[i]) {
        sum += a;
        size += std::abs(a);
      }
      CAPTURE(s.name, i);
      CHECK(std::abs(sum - s.c[i]) <= 1e-15 * size);
    }
}

TEST_CASE("explicit schemes: steps, estimates and dense output have their orders") {
  // Orders are read off where the error is still some 1e3 roundings.
  struct Expected {
    const char* name;
    int n;
    double order, dense_order;
  };
  for (const Expected& e : {Expected{"dopri5", 24, 5, 5}, {"dop853", 2, 8, 8}}) {
    const ExplicitScheme& s = *find_explicit_scheme(e.name);
    const auto exact = solve(s, 64 * e.n);
    const double ratio = apart(solve(s, e.n), exact) / apart(solve(s, 2 * e.n), exact);
    CAPTURE(e.name, ratio);
    CHECK(std::log2(ratio) >= e.order - 0.3);
    // Within a step the local error of the dense output, of order 4 and 7, falls by one power more.
    const auto off = [&](int n) {
      // The same time within the last step, by a finer solution that ends there.
      const double within = 0.4, t = 1 - (1 - within) / n;
      ExplicitStep step(s, 2, true, rates);
      std::array<double, 3> y = {1, 0.3, 0};
      step.begin(0, y.data());
      const int fine = 64 * n;
      for (int i = 0; i < fine; ++i) {
        if (i > 0) step.go_on();
        step.attempt(t / fine, t * (i + 1) / fine);
      }
      std::copy(step.end(), step.end() + 3, y.begin());
      return apart(solve(s, n, within), y);
    };
    CHECK(std::log2(off(e.n) / off(2 * e.n)) >= e.dense_order - 1);
  }
}

TEST_CASE("explicit schemes: adjoint and tangent agree to rounding, in every formulation") {
  for (const std::string& formulation : with_right_hand_side())
    for (const auto& scheme : explicit_schemes())
      for (const auto& model : {five_bar(), kitchen_sink(), pendulum(1, 2), free_flight()}) {
        CAPTURE(formulation, scheme.name, model.name);
        // Tolerances so loose that the steps' own errors are large: the gradient is that of the steps all the same.
        check_transposed(on_scheme(model, formulation, scheme.name, 1e-4, std::min(model.t_end, 1.0)), 1e-13);
      }
}

TEST_CASE("explicit schemes: the gradient is that of psi over the same steps") {
  int held = 0;
  for (const char* formulation : {"index1", "baumgarte", "penalty", "augmented-lagrangian", "maggi"})
    for (const auto& scheme : explicit_schemes())
      for (const auto& [model, t_end] : {std::pair{five_bar(), 1.0}, {kitchen_sink(), 0.4}, {pendulum(1, 2), 1.0}}) {
        CAPTURE(formulation, scheme.name, model.name);
        held += check_over_held_steps<HeldSteps>(on_scheme(model, formulation, scheme.name, 1e-4, t_end)) ? 1 : 0;
      }
  CHECK(held >= 24);  // of 30: but for some of Maggi's
}

TEST_CASE("explicit schemes: at tight tolerances the gradient is that of the motion") {
  for (const auto& scheme : explicit_schemes())
    for (const auto& model : {five_bar(), kitchen_sink()}) {
      Problem p = on_scheme(model, "baumgarte", scheme.name, 1e-11, 1);
      const auto rho = p.parameters.values();
      const GradientResult discrete = gradient(p, "discrete-adjoint", rho);
      const GradientResult other = gradient(p, "idas-adjoint", rho);
      CAPTURE(scheme.name, model.name);
      // Both errors are some 100 rtol.
      CHECK(discrete.psi == Approx(other.psi).epsilon(1e-8));
      CHECK(apart_in_scales(discrete.gradient, other.gradient, p) <= 1e-7);
    }
}

TEST_CASE("explicit schemes: a motion without errors is not stepped beyond what its stabilization bears") {
  // A wheel about its centre of mass: the coordinates move on lines, the constraints have no error, and steps of a
  // second would make 1e6 of one each. psi is cos(0.3 + 10 w).
  Problem p = make_problem(Scene::parse(R"toml([point.O]
ground = true
x_m = 0
y_m = 0
[body.wheel]
x_m = 0
y_m = 0
mass_kg = 1
inertia_kg_m2 = 2
angle_rad = 0.3
angular_velocity_rad_per_s = 7
[point.pin]
on = "wheel"
x_m = 0
y_m = 0
[point.Q]
on = "wheel"
x_m = 1
y_m = 0
[revolute.a]
points = ["O", "pin"]
[start]
given = ["wheel.angle"]
[[cost.terminal]]
kind = "value"
output = "Q.x"
[run]
t_end_s = 10
parameters = ["body.wheel.angular_velocity_rad_per_s"]
)toml",
                                        "wheel.toml"));
  const double right = -10 * std::sin(0.3 + 70);
  for (const char* formulation : {"baumgarte", "penalty", "augmented-lagrangian"})
    for (const char* scheme : {"dopri5", "dop853"}) {
      INFO(formulation << " by " << scheme);
      p.formulation = formulation;
      p.solver.integrator = scheme;
      for (const char* method : {"discrete-adjoint", "discrete-tangent"}) {
        const GradientResult r = gradient(p, method, p.parameters.values());
        CHECK(std::abs(r.gradient[0] - right) < 1e-8);
        // The bound of a step: 0.7 of what the scheme bears, over 10 rad/s; that of idle steps (lib/README.md (16.5))
        // is 1/121 of the run.
        CHECK(r.counters.steps >= (scheme == std::string("dopri5") ? 43 : 23));
        CHECK(r.counters.steps <= 140);
      }
    }
  p.formulation = "index1";
  CHECK(gradient(p, "discrete-adjoint", p.parameters.values()).counters.steps <= 140);
}

TEST_CASE("explicit schemes: where tyres leave the ground their gradients stay right") {
  // -0.0211533973 by cvodes-forward at rtol 1e-11, by baumgarte, index1 and maggi. Of these 1e-4, and up to 1.5e-3, was
  // what steps over ten bends left; seen are up to 5e-6.
  Problem p = make_problem(Scene::load(COSTATE_SOURCE_DIR "/test/cases/wheels_lift_off.toml"));
  p.solver.confirm = false;
  for (const auto& [formulation, scheme] :
       {std::pair{"baumgarte", "dopri5"}, {"index1", "dop853"}, {"maggi", "dopri5"}})
    for (const double rtol : {1e-7, 1.5e-8, 1.5e-9, 5e-10}) {
      CAPTURE(formulation, scheme, rtol);
      p.formulation = formulation;
      p.solver.integrator = scheme;
      p.solver.rtol = rtol;
      const GradientResult r = gradient(p, "discrete-tangent", p.parameters.values());
      CHECK(std::abs(r.gradient[0] / -0.0211533973 - 1) < 2e-5);
    }
}

TEST_CASE("explicit schemes: gradients across touches whose force begins with a slope") {
  // A ball on a linear spring of the ground, three bounces: a point mass whose motion between and during the touches is
  // known (gravity; a sine about the sag), psi its height at the end, after the third. Its derivatives by differences
  // of that; steps over touches had left 5 to 27 % of the largest.
  constexpr double m = 1.5, g = 9.81, R = 0.1, end = 1.9;
  const auto height = [&](double K, double v0) {
    const double w = std::sqrt(K / m), sag = m * g / K;
    double t = 0, y = 0.4, v = v0;  // of the lowest point
    for (;;) {
      const double down = (v + std::sqrt(v * v + 2 * g * y)) / g;
      if (t + down > end) return R + y + v * (end - t) - 0.5 * g * (end - t) * (end - t);
      const double into = g * down - v;
      // Below the ground by d = sag (1 - cos w s) + into/w sin w s, until it is zero again; left at the same speed.
      const double stay = 2 * (M_PI - std::atan2(into / w, sag)) / w;
      REQUIRE(t + down + stay < end);
      t += down + stay;
      y = 0;
      v = into;
    }
  };
  const double K = 2000, dK = 1e-3 * K, dv = 1e-3;
  const auto slope = [](auto f, double h) { return (8 * (f(h / 2) - f(-h / 2)) - (f(h) - f(-h))) / (6 * h); };
  const double by_K = slope([&](double h) { return height(K + h, 0); }, dK),
               by_v = slope([&](double h) { return height(K, h); }, dv);
  Problem p = make_problem(Scene::parse(R"toml([gravity]
y_m_per_s2 = -9.81
[body.ball]
x_m = 0
y_m = 0.5
mass_kg = 1.5
inertia_kg_m2 = 0.006
[point.C]
on = "ball"
x_m = 0
y_m = 0
[contact.floor]
point = "C"
law = "linear"
stiffness_N_per_m_n = 2000
radius_m = 0.1
[start]
given = ["ball.x", "ball.y", "ball.angle"]
[[cost.terminal]]
kind = "value"
output = "ball.y"
[run]
t_end_s = 1.9
parameters = ["contact.floor.stiffness_N_per_m_n", "body.ball.vy_m_per_s"]
)toml",
                                        "ball.toml"));
  p.formulation = "baumgarte";
  for (const char* scheme : {"dopri5", "dop853", "radau9"})
    for (const double rtol : {1e-7, 1e-8, 1e-9}) {
      CAPTURE(scheme, rtol);
      p.solver.integrator = scheme;
      p.solver.rtol = rtol;
      p.solver.confirm = false;
      const GradientResult r = gradient(p, "discrete-adjoint", p.parameters.values());
      CHECK(std::abs(r.psi - height(K, 0)) < 1e2 * rtol);
      CHECK(std::abs(r.gradient[0] * K - by_K * K) < 1e-4 * std::abs(by_v));
      CHECK(std::abs(r.gradient[1] - by_v) < 1e-4 * std::abs(by_v));
    }
}

TEST_CASE("explicit schemes: stages that do not fit are computed again") {
  for (const char* formulation : {"baumgarte", "maggi"})
    for (const auto& scheme : explicit_schemes()) {
      CAPTURE(formulation, scheme.name);
      // On this one Maggi changes its coordinates.
      check_computed_again(on_scheme(pendulum(1, 2), formulation, scheme.name, 1e-8), 0.004);
    }
}

TEST_CASE("explicit schemes: where records do not fit stages do") {
  const Problem p = on_scheme(five_bar(), "index1", "dop853", 1e-9);
  const auto rho = p.parameters.values();
  const GradientResult all = gradient(p, "discrete-adjoint", rho);
  Problem less = p;
  // Stages of 12 evaluations of some tens of numbers, records of some hundreds each.
  less.solver.memory_budget_MB = 8e-6 * static_cast<double>(all.counters.steps) * 12 * 40;
  const GradientResult stages = gradient(less, "discrete-adjoint", rho);
  // The same run; each stage's matrices are factored once more, and nothing is evaluated again.
  CHECK(stages.counters.checkpoints == 0);
  CHECK(stages.counters.backward_residuals == all.counters.backward_residuals);
  CHECK(stages.counters.factorizations > all.counters.factorizations);
  CHECK(stages.psi == all.psi);
  CHECK(apart_in_scales(stages.gradient, all.gradient, p) <= kTransposeOfSteps);
}

TEST_CASE("explicit schemes: steps end at the kinks of drivers, and gradients are carried across") {
  check_kinks_met(with_right_hand_side(), explicit_names());
}

TEST_CASE("explicit schemes: events are met, however short what lies between two of them") {
  check_events_met(explicit_names());
}

TEST_CASE("explicit schemes: what they do not carry is refused by name") {
  Problem p = on_scheme(five_bar(), "index2", "dop853", 1e-6);
  const auto rho = p.parameters.values();
  CHECK_THROWS_WITH(simulate(p, rho), Contains("without an explicit right-hand side"));
  CHECK_THROWS_WITH(gradient(p, "discrete-adjoint", rho), Contains("without an explicit right-hand side"));
  p.formulation = "baumgarte";
  p.solver.integrator = "dop85";
  CHECK_THROWS_WITH(simulate(p, rho), Contains("Did you mean 'dop853'?"));
}
