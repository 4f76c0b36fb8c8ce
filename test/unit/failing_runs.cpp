// Runs that fail: exceptions from elements arrive with their type through both integrators, forward and backward; a
// failing integration says when, at which step, and which unknowns were the worst.
#include <support/costs.h>
#include <support/models.h>
#include <support/paths.h>
#include <support/sketch.h>
#include <support/variants.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

#include "costate/analysis/complaints.h"
#include "costate/base/error.h"
#include "costate/element/complaint.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using namespace costate::test;
using Catch::Matchers::Contains;

namespace {

struct Boom : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A force of 1 N on a point that throws where it is told to.
class ThrowingForce final : public ForceOf<ThrowingForce> {
 public:
  enum class Where { force, partials };
  struct Trap {
    Where where = Where::force;
    double from = 1e9, to = 1e9;  // s
    bool set = false;
  };
  ThrowingForce(const PlanarPoint& point, std::shared_ptr<const Trap> trap)
      : ForceOf("force", "trap"), trap_(std::move(trap)) {
    append_coordinates(point.coordinates());
  }
  template <class S>
  void physics(const S& t, const S*, const S*, const S*, const S*, S* Q, S*) const {
    spring(Where::force, value_of(t));
    Q[1] = S(1.0);
  }
  void calc_partials(const LocalState& s, ForcePartials) const override { spring(Where::partials, s.t); }

 private:
  void spring(Where where, double t) const {
    if (trap_->set && where == trap_->where && t >= trap_->from && t <= trap_->to)
      throw Boom("the trap at t = " + std::to_string(t) + " s");
  }
  std::shared_ptr<const Trap> trap_;
};

struct Trapped {
  TestModel model;
  std::shared_ptr<ThrowingForce::Trap> trap = std::make_shared<ThrowingForce::Trap>();
};

Trapped trapped_pendulum() {
  Trapped r;
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("O", 0, 0);
  s.point("P", 1, 0);
  s.mass("P", 1);
  s.distance("rod", "O", "P");
  s.builder.add(std::make_unique<ThrowingForce>(s.builder.point("P"), r.trap));
  s.give({"P.y"});
  s.numbers("cost", {{"weight", 1}});
  s.parameter("mass", "mass.P.mass_kg");
  s.builder.set_default_parameters({"mass"});
  r.model = {"trapped pendulum", s.builder.build(), {}, 1};
  r.model.objective.running = {output_term(*r.model.mechanism, "P.x", 2, "cost.weight")};
  return r;
}

}  // namespace

TEST_CASE("failing runs: an exception from a force arrives with its type and message", "[failing]") {
  for (const auto& f : formulations()) {
    for (const std::string& method : integrator_methods(f.name)) {
      Trapped t = trapped_pendulum();
      const Problem p = t.model.problem(f.name, 1e-6);
      const std::vector<double> rho = p.parameters.values();
      for (const auto where : {ThrowingForce::Where::force, ThrowingForce::Where::partials}) {
        INFO(f.name << ", " << method << (where == ThrowingForce::Where::force ? ", force" : ", partials"));
        *t.trap = {where, 0.4, 1e9, true};
        CHECK_THROWS_AS(gradient(p, method, rho), Boom);
        CHECK_THROWS_WITH(gradient(p, method, rho), Contains("the trap at t = 0."));
      }
      // Only on the way back: the trap is set when the backward run has begun.
      if (method.find("adjoint") != std::string::npos) {
        INFO(f.name << ", " << method << ", backward");
        *t.trap = {ThrowingForce::Where::partials, 0, 0.5, false};
        Problem back = p;
        long backward_calls = 0;
        back.monitor = [&](double, long, bool backward) {
          if (!backward) return;
          ++backward_calls;
          t.trap->set = true;
        };
        CHECK_THROWS_AS(gradient(back, method, rho), Boom);
        CHECK(backward_calls > 0);
      }
      // Afterwards everything works again.
      t.trap->set = false;
      CHECK(std::isfinite(gradient(p, method, rho).gradient.at(0)));
    }
  }
}

TEST_CASE("failing runs: an exception of the monitor stops the run", "[failing]") {
  struct Stop {};
  for (const auto& f : formulations()) {
    for (const std::string& method : integrator_methods(f.name)) {
      INFO(f.name << ", " << method);
      Problem p = five_bar().problem(f.name, 1e-6);
      p.monitor = [](double t, long, bool) {
        if (t > 1) throw Stop();
      };
      CHECK_THROWS_AS(gradient(p, method, p.parameters.values()), Stop);
    }
  }
}

TEST_CASE("failing runs: too many steps", "[failing]") {
  for (const auto& f : formulations())
    for (const char* integrator : {"idas", "cvodes", "radau3", "dopri5"}) {
      const bool residual = integrator == std::string("idas") || integrator == std::string("radau3");
      if (residual ? !f.make_dae : !f.make_ode) continue;
      INFO(f.name << ", " << integrator);
      Problem p = five_bar().problem(f.name, 1e-8);
      p.solver.integrator = integrator;
      p.solver.max_steps = 20;
      CHECK_THROWS_AS(simulate(p, p.parameters.values()), TooMuchWork);
      CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Contains("at t = ") && Contains("after 20 steps") &&
                                                                Contains("step size") && Contains("TOO_MUCH_WORK"));
    }
}

// Segments between jumps are sessions of their own; the limit is that of the run.
TEST_CASE("failing runs: too many steps in all segments together", "[failing]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/bouncing_ball.toml"));
  for (const char* integrator : {"idas", "cvodes"}) {
    CAPTURE(integrator);
    p.solver.integrator = integrator;
    p.solver.max_steps = SolverOptions{}.max_steps;
    const Counters all = simulate(p, p.parameters.values()).counters;
    REQUIRE(all.jumps > 10);
    p.solver.max_steps = all.steps;
    CHECK(simulate(p, p.parameters.values()).counters.steps == all.steps);
    p.solver.max_steps = all.steps - 1;
    CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Contains("reached its limit of steps"));
  }
}

namespace {

// F = (0.5 - t)^-2.5 on the x of a free mass, not a number beyond: no step crosses t = 0.5 s.
struct BlowUp final : ForceOf<BlowUp> {
  explicit BlowUp(const PlanarPoint& point) : ForceOf("force", "blow-up") { append_coordinates(point.coordinates()); }
  template <class S>
  void physics(const S& t, const S*, const S*, const S*, const S*, S* Q, S*) const {
    using std::sqrt;
    const S d = 0.5 - t;
    Q[0] = 1.0 / (d * d * sqrt(d));
  }
};

}  // namespace

TEST_CASE("failing runs: an explosion names its time and the worst unknowns", "[failing]") {
  Sketch s;
  s.ground("O", 0, 0);
  s.point("P", 1, 0);
  s.point("R", 2, 0);
  s.mass("P", 1);
  s.mass("R", 1);
  s.distance("rod", "O", "R");
  s.builder.add(std::make_unique<BlowUp>(s.builder.point("P")));
  s.give({"P.x", "P.y", "R.y"});
  TestModel model{"explosion", s.builder.build(), {}, 1};
  for (const auto& f : formulations())
    for (const char* integrator : {"idas", "cvodes"}) {
      if (integrator == std::string("idas") ? !f.make_dae : !f.make_ode) continue;
      INFO(f.name << ", " << integrator);
      Problem p = model.problem(f.name, 1e-6);
      p.solver.integrator = integrator;
      std::string message;
      try {
        simulate(p, {});
      } catch (const SolverError& e) {
        message = e.what();
      }
      INFO(message);
      CHECK_THAT(message, Contains("at t = 0.49") || Contains("at t = 0.5 s"));
      CHECK_THAT(message, Contains("steps, step size"));
      CHECK_THAT(message, Contains("Largest local errors: P.x") || Contains("Fastest changes: P.x"));
    }
}

namespace {
/// A force of 2 N that ends somewhere and knows it.
class EndingForce final : public ForceOf<EndingForce>, public ComplainingElement {
 public:
  explicit EndingForce(const PlanarPoint& point) : ForceOf("force", "ending") {
    append_coordinates(point.coordinates());
  }
  template <class S>
  void physics(const S&, const S* q, const S*, const S*, const S*, S* Q, S*) const {
    if (value_of(q[0]) > 1) throw StepError("Beyond x = 1 m this force is not defined.");
    Q[0] = S(2.0);
  }
  void add_complaints(const LocalState& s, std::vector<std::string>& said) const override {
    if (s.q[0] > 0.75) said.push_back("is near its end");
  }
};
}  // namespace

// x'' = 2 N / 4 kg: the point comes to x = 1 m at t = 2 s. The other point's spring and damper are weaker, 0.8 N / 4 kg
// at their end, and steeper: sqrt(400 / 4) = 10 1/s by its stiffness, 100 / 4 = 25 1/s by its damping.
TEST_CASE("failing runs: elements say what they are at, and which force is the largest and the steepest", "[failing]") {
  Sketch s;
  s.ground("O", 0, 5);
  s.point("P", 0, 0);
  s.point("R", 1.002, 5);
  s.mass("P", 4);
  s.mass("R", 4);
  s.spring("S", "O", "R", {.stiffness = 400, .natural = 1, .damping = 100, .spring = {}, .damper = {}});
  s.builder.add(std::make_unique<EndingForce>(s.builder.point("P")));
  s.give({"P.x", "P.y", "R.x", "R.y"});
  TestModel model{"", s.builder.build(), {}, 4};
  Assembly assembly(model.mechanism, {});
  std::vector<double> q{0.5, 0, 1.002, 5}, v(4, 0.0);
  StateView state{.t = 1, .q = q.data(), .v = v.data()};
  const std::string forces =
      "Largest force: force.ending (alone it accelerates P.x by 0.5 m/s^2). Steepest force: spring.S (25 1/s).";
  CHECK(element_complaints(assembly, state) == forces);
  q[0] = 0.9;
  CHECK(element_complaints(assembly, state) == "At its limit: force.ending is near its end. " + forces);
  for (const char* integrator : {"idas", "cvodes", "dop853", "radau5"}) {
    CAPTURE(integrator);
    Problem p = model.problem("index1", 1e-6);
    p.solver.integrator = integrator;
    CHECK_THROWS_WITH(simulate(p, {}), Contains("at t = 1.9") || Contains("at t = 2 s"));
    CHECK_THROWS_WITH(simulate(p, {}), Contains("Beyond x = 1 m this force is not defined.") &&
                                           Contains("At its limit: force.ending is near its end."));
  }
}

TEST_CASE("failing runs: coinciding ends of a spring", "[failing]") {
  Sketch s;
  s.ground("O", 0, 0);
  s.point("P", 0, 0);
  s.mass("P", 1);
  s.spring("S", "O", "P", {.stiffness = 10, .natural = 1, .spring = {}, .damper = {}});
  s.give({"P.x", "P.y"});
  TestModel model{"", s.builder.build(), {}, 1};
  const Problem p = model.problem("index1", 1e-6);
  CHECK_THROWS_AS(simulate(p, {}), ModelError);
  CHECK_THROWS_WITH(simulate(p, {}), Contains("spring.S: The length between 'O' and 'P' fell to 0 m"));
}

TEST_CASE("failing runs: values that do not match the parameters", "[failing]") {
  const Problem p = five_bar().problem("index1", 1e-6);
  CHECK_THROWS_WITH(simulate(p, {}), Contains("but 0 values are given"));
  CHECK_THROWS_WITH(gradient(p, "idas-adjoint", {1.0}), Contains("but 1 values are given"));
  std::vector<double> rho = p.parameters.values();
  rho[0] = std::nan("");
  CHECK_THROWS_WITH(simulate(p, rho), Contains("'" + p.parameters.parameters[0].name + "' is nan"));
}
