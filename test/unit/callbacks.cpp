// What happens inside the callbacks: no allocation after set-up, and no exception through a C frame.
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <new>

#include "costate/element/force/force_law.h"
#include "costate/kind/body/bar.h"
#include "costate/kind/body/point.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

namespace {
std::atomic<bool> armed{false};
std::atomic<long> allocations{0};
}  // namespace

void* operator new(std::size_t size) {
  if (armed) ++allocations;
  if (void* p = std::malloc(size ? size : 1)) return p;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  if (armed) ++allocations;
  return std::malloc(size ? size : 1);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

using namespace costate;

namespace {

/// Everything at once: bars, a rigid body with offset mass, states, laws, a driver; cost in q, v, a and lambda.
const char* const kScene = R"(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0.2
[bar.AP]
from = "A"
to = "P"
mass_kg = 1
[body.B]
x_m = 1
y_m = 0.2
angle_rad = -0.5
mass_kg = 2
inertia_kg_m2 = 0.3
center_x_m = 0.4
[point.Q]
on = "B"
x_m = 0
y_m = 0
[revolute.J]
points = ["P", "Q"]
[point.R]
on = "B"
x_m = 0.8
y_m = 0.1
[spring.S]
from = "A"
to = "R"
stiffness_N_per_m = 50
natural_length_m = 1.2
damping_N_s_per_m = 2
[maxwell.W]
from = "A"
to = "P"
stiffness_N_per_m = 10
natural_length_m = 1
damping_N_s_per_m = 3
[start]
given = ["P.y", "B.angle"]
[[cost.running]]
kind = "square"
output = "R.y"
[[cost.running]]
kind = "square"
output = "B.angle_ddot"
weight = 0.01
[[cost.running]]
kind = "square"
output = "J.reaction_x"
weight = 1e-3
[parameter.k]
number = "spring.S.stiffness_N_per_m"
[parameter.L]
number = "bar.AP.length_m"
[parameter.m]
number = "body.B.mass_kg"
[run]
t_end_s = 0.5
parameters = ["k", "L", "m"]
)";

Problem problem() {
  const Scene scene = Scene::parse(kScene, "callbacks.toml");
  Problem p;
  p.mechanism = scene.mechanism();
  p.objective = scene.objective();
  p.parameters = p.mechanism->select({});
  p.solver.t_end = 0.5;
  return p;
}

template <class F>
long counted(F&& f) {
  f();
  f();  // buffers have grown once, pivots are known
  allocations = 0;
  armed = true;
  f();
  armed = false;
  return allocations;
}

}  // namespace

TEST_CASE("DAE callbacks allocate nothing after set-up") {
  for (const auto& f : formulations()) {
    if (!f.make_dae) continue;
    Problem p = problem();
    p.formulation = f.name;
    const auto system = p.make_dae();
    const auto n = static_cast<std::size_t>(system->size());
    std::vector<double> y(n), yp(n), r(n), x(n, 0.1), g(3),
        values(static_cast<std::size_t>(system->jacobian_pattern().entries()));
    Eigen::MatrixXd y_rho, yp_rho, columns(system->size(), 3);
    system->start(0, y.data(), yp.data(), &y_rho, &yp_rho);
    INFO(f.name);
    CHECK(counted([&] { system->residual(0, y.data(), yp.data(), r.data()); }) == 0);
    CHECK(counted([&] {
            y[0] += 1e-9;
            system->factor(0, y.data(), yp.data(), 100);
            system->solve(r.data());
            system->solve_transposed(r.data());
          }) == 0);
    CHECK(counted([&] { system->jacobian(0, y.data(), yp.data(), 10, values.data()); }) == 0);
    CHECK(counted([&] {
            y[0] += 1e-9;
            system->linearize(0, y.data(), yp.data());
            system->add_product(1, x.data(), r.data());
            system->add_transposed_product(1, x.data(), r.data());
            system->parameter_columns(columns);
            system->add_parameter_gradient(1, x.data(), g.data());
            system->running_cost_gradient(0, y.data(), r.data(), 1, g.data());
            system->running_cost(0, y.data());
          }) == 0);
  }
}

TEST_CASE("ODE callbacks allocate nothing after set-up") {
  for (const auto& f : formulations()) {
    if (!f.make_ode) continue;
    Problem p = problem();
    p.formulation = f.name;
    const auto system = p.make_ode();
    const auto n = static_cast<std::size_t>(system->size());
    std::vector<double> y(n), r(n), x(n, 0.1), g(3);
    Eigen::MatrixXd y_rho;
    system->start(0, y.data(), &y_rho);
    std::vector<double> out(3 * n);
    const double* in[3] = {x.data(), x.data(), x.data()};
    double* columns[3] = {out.data(), out.data() + n, out.data() + 2 * n};
    INFO(f.name);
    CHECK(counted([&] {
            y[0] += 1e-9;
            system->rhs(0, y.data(), r.data());
          }) == 0);
    CHECK(counted([&] {
            y[0] += 1e-9;
            system->factor(0, y.data(), 1e-3);
            system->solve(r.data());
            system->solve_transposed(r.data());
          }) == 0);
    CHECK(counted([&] {
            y[0] += 1e-9;
            system->tangent(0, y.data(), in, columns, 3, true);
            system->tangent_running_cost(0, y.data(), in, g.data(), 3);
            system->adjoint_rhs(0, y.data(), x.data(), r.data());
            system->adjoint_integrand(0, y.data(), x.data(), g.data());
            system->running_cost(0, y.data());
          }) == 0);
  }
}

namespace {

struct OutOfRange : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A cost that throws once the simulation has gone some way, forward or (from its gradient) backward.
class Throwing final : public CostTerm {
 public:
  Throwing(double from, bool in_gradient) : from_(from), in_gradient_(in_gradient) {}
  double value(const StateView& s, Assembly&) const override {
    if (!in_gradient_ && s.t > from_) throw OutOfRange("the value is out of range");
    return s.q[0];
  }
  void add_gradient(const StateView& s, Assembly&, double factor, ScalarGradient& g) const override {
    if (in_gradient_ && s.t < 0.1 && backward) throw OutOfRange("the gradient is out of range");
    g.q[0] += factor;
  }
  static inline bool backward = false;

 private:
  double from_;
  bool in_gradient_;
};

}  // namespace

TEST_CASE("an exception from inside a callback arrives with its type and text") {
  for (const char* method : {"idas-forward", "idas-adjoint", "cvodes-forward", "cvodes-adjoint"}) {
    Problem p = problem();
    p.formulation = "baumgarte";
    p.objective.running = {std::make_shared<Throwing>(0.2, false)};
    INFO(method);
    CHECK_THROWS_AS(gradient(p, method, p.parameters.values()), OutOfRange);
    CHECK_THROWS_WITH(gradient(p, method, p.parameters.values()), Catch::Contains("out of range"));
  }
  for (const char* method : {"idas-adjoint", "cvodes-adjoint"}) {
    Problem p = problem();
    p.formulation = "baumgarte";
    p.objective.running = {std::make_shared<Throwing>(0, true)};
    p.monitor = [](double, long, bool backward) { Throwing::backward = backward; };
    INFO(method << ", backward");
    CHECK_THROWS_AS(gradient(p, method, p.parameters.values()), OutOfRange);
    Throwing::backward = false;
  }
}
