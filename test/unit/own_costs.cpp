// Costs and outputs of one's own: derivatives by hand that are wrong, and a promise that is not kept, are told before a
// run, and not carried into a gradient on which all methods agree.
#include <catch2/catch.hpp>
#include <memory>
#include <string>

#include "costate/base/error.h"
#include "costate/hessian/hessian_products.h"
#include "costate/integrator/simulate.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/point.h"
#include "costate/kind/force/spring.h"
#include "costate/mechanism/builder.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;

namespace {

/// p x^2 vy + x sin(t) with everything by hand, of which `wrong` is as the name says.
class Work final : public CostTerm {
 public:
  Work(int x, int p, std::string wrong) : x_(x), p_(p), wrong_(std::move(wrong)) {}
  double value(const StateView& s, Assembly& a) const override {
    return a.numbers()[p_] * s.q[x_] * s.q[x_] * s.v[x_ + 1] + s.q[x_] * std::sin(s.t);
  }
  void add_gradient(const StateView& s, Assembly& a, double factor, ScalarGradient& g) const override {
    const double p = a.numbers()[p_], x = s.q[x_], vy = s.v[x_ + 1];
    if (wrong_ == "factor") factor = 1;
    const double late = s.t > 1 ? by("late") : 1, negative = x < 0 ? by("negative") : 1;
    if (wrong_ == "set") g.q[x_] = 0;
    g.q[x_] += factor * (2 * p * x * vy + std::sin(s.t)) * by("position") * late * negative;
    g.v[x_ + 1] += factor * p * x * x * by("velocity");
    g.add_number(a, p_, factor * x * x * vy * by("parameter"));
  }
  bool needs_accelerations() const override { return false; }
  double change(const StateView& s, Assembly& a, const Variation& d) const override {
    const double p = a.numbers()[p_], x = s.q[x_], vy = s.v[x_ + 1];
    return (2 * p * x * vy + std::sin(s.t)) * d.q[x_] + p * x * x * d.v[x_ + 1] + x * x * vy * d.numbers[p_] +
           x * std::cos(s.t) * d.t * by("change");
  }
  void add_gradient_change(const StateView& s, Assembly& a, const Variation& d, ScalarGradient& g) const override {
    const double p = a.numbers()[p_], x = s.q[x_], vy = s.v[x_ + 1], dx = d.q[x_], dvy = d.v[x_ + 1];
    const double dp = d.numbers[p_];
    g.q[x_] += 2 * (dp * x * vy + p * dx * vy + p * x * dvy * by("second")) + std::cos(s.t) * d.t;
    g.v[x_ + 1] += dp * x * x + 2 * p * x * dx;
    g.add_number(a, p_, 2 * x * dx * vy + x * x * dvy);
  }

 private:
  double by(const char* what) const { return wrong_ == what ? 0.99 : 1; }
  int x_, p_;
  std::string wrong_;
};

/// Accelerations squared, above `still`, with or without saying so.
class Jolt final : public DualCostTerm<Jolt> {
 public:
  Jolt(int x, bool says, double still = 0) : x_(x), says_(says), still_(still) {}
  template <class S>
  S physics(const CostArguments<S>& at) const {
    const S& a = at.a[x_];
    return value_of(a * a) < still_ ? S(0.0) : a * a;
  }
  bool needs_accelerations() const override { return says_; }

 private:
  int x_;
  bool says_;
  double still_;
};

/// |x| x, whose second derivative jumps, and a kink in time: differences tell nothing there, and nothing is refused.
class Bent final : public DualCostTerm<Bent> {
 public:
  explicit Bent(int x) : x_(x) {}
  template <class S>
  S physics(const CostArguments<S>& at) const {
    const S& x = at.q[x_];
    return (value_of(x) < 0 ? -x * x : x * x) + (value_of(at.t) < 0.3695 ? S(0.0) : at.t - S(0.3695));
  }
  bool needs_accelerations() const override { return false; }

 private:
  int x_;
};

class Height final : public Output {
 public:
  Height(int y, double factor) : Output("own.height", "m"), y_(y), factor_(factor) {}
  double value(const StateView& s, Assembly&) const override { return s.q[y_] * s.q[y_]; }
  void add_gradient(const StateView& s, Assembly&, double factor, ScalarGradient& g) const override {
    g.q[y_] += factor * factor_ * 2 * s.q[y_];
  }

 private:
  int y_;
  double factor_;
};

struct Hanging {
  Problem problem;
  int x, k;
  Hanging() {
    MechanismBuilder b;
    b.set_gravity(0, -9.81);
    add_ground_point(b, "O", 0, 0);
    add_free_point(b, "P", {1, -0.5, 0, 0});
    add_mass(b, "m", "P", 2);
    add_spring(b, "s", "O", "P", {40, 0.3, 1});
    x = b.coordinate("P.x");
    k = b.number("spring.s.stiffness_N_per_m");
    problem.mechanism = b.build();
    problem.parameters = problem.mechanism->select({"spring.s.stiffness_N_per_m"});
    problem.solver.t_end = 0.5;
  }
  std::vector<double> rho() const { return problem.parameters.values(); }
  Problem with(std::shared_ptr<const CostTerm> term) const {
    Problem p = problem;
    p.objective.running.push_back(std::move(term));
    return p;
  }
};

}  // namespace

TEST_CASE("own costs: derivatives by hand are those of the value, or told with the argument") {
  const Hanging h;
  const auto rho = h.rho();
  const auto of = [&](const char* wrong) { return h.with(std::make_shared<Work>(h.x, h.k, wrong)); };
  const Problem good = of("nothing");
  const double exact = gradient(good, "differences", rho).gradient[0];
  for (const char* method : {"idas-adjoint", "cvodes-forward", "discrete-adjoint"})
    CHECK(gradient(good, method, rho).gradient[0] == Approx(exact).epsilon(1e-5));
  CHECK_NOTHROW(hessian_products(good, rho, Eigen::MatrixXd::Identity(1, 1)));
  const auto refused = [&](const char* wrong, const char* function, const char* argument) {
    const auto tells = [&](const auto& run) {
      CHECK_THROWS_WITH(run(), Contains("The running cost's term 0") && Contains(function) && Contains(argument));
    };
    for (const char* method : {"idas-adjoint", "cvodes-forward", "discrete-adjoint"})
      tells([&] { gradient(of(wrong), method, rho); });
    tells([&] { hessian_products(of(wrong), rho, Eigen::MatrixXd::Identity(1, 1)); });
    CHECK_NOTHROW(simulate(of(wrong), rho));
    CHECK(gradient(of(wrong), "differences", rho).gradient[0] == Approx(exact).epsilon(1e-12));
  };
  refused("position", "add_gradient()", "position of 'P.x'");
  refused("velocity", "add_gradient()", "velocity of 'P.y'");
  refused("parameter", "add_gradient()", "parameter 'spring.s.stiffness_N_per_m'");
  refused("factor", "add_gradient()", "with a factor");
  refused("set", "add_gradient()", "with a factor");
  refused("late", "add_gradient()", "position of 'P.x'");
  refused("negative", "add_gradient()", "position of 'P.x'");
  refused("change", "change()", "along a direction");
  refused("second", "add_gradient_change()", "position of 'P.x'");
}

TEST_CASE("own costs: what was refused once is refused again") {
  const Hanging h;
  const auto rho = h.rho();
  const Problem wrong = h.with(std::make_shared<Work>(h.x, h.k, "position"));
  for (int again : {0, 1}) {
    INFO(again);
    CHECK_THROWS_WITH(gradient(wrong, "idas-adjoint", rho), Contains("add_gradient()"));
  }
  const Problem silent = h.with(std::make_shared<Jolt>(h.x, false));
  for (int again : {0, 1}) {
    INFO(again);
    CHECK_THROWS_WITH(simulate(silent, rho), Contains("needs_accelerations()"));
  }
}

TEST_CASE("own costs: accelerations that are not spoken of") {
  const Hanging h;
  const auto rho = h.rho();
  const Problem silent = h.with(std::make_shared<Jolt>(h.x, false)), says = h.with(std::make_shared<Jolt>(h.x, true));
  CHECK_THROWS_WITH(simulate(silent, rho), Contains("needs_accelerations() says that it does not"));
  CHECK_THROWS_WITH(gradient(silent, "idas-adjoint", rho), Contains("needs_accelerations()"));
  CHECK_THROWS_WITH(simulate(h.with(std::make_shared<Jolt>(h.x, false, 9)), rho), Contains("needs_accelerations()"));
  CHECK_NOTHROW(simulate(says, rho));
  CHECK_NOTHROW(gradient(says, "idas-adjoint", rho));
}

TEST_CASE("own costs: where differences tell nothing, nothing is refused") {
  const Hanging h;
  CHECK_NOTHROW(gradient(h.with(std::make_shared<Bent>(h.x)), "idas-adjoint", h.rho()));
}

TEST_CASE("own outputs: their derivatives in a cost") {
  const Hanging h;
  const auto rho = h.rho();
  const auto of = [&](double factor) {
    return h.with(std::make_shared<OutputTerm>(std::make_shared<Height>(h.x + 1, factor), 1, -1, OutputTerm::Target{}));
  };
  CHECK(gradient(of(1), "idas-adjoint", rho).gradient[0] ==
        Approx(gradient(of(1), "differences", rho).gradient[0]).epsilon(1e-5));
  CHECK_THROWS_WITH(gradient(of(0.99), "idas-adjoint", rho), Contains("position of 'P.y'"));
}
