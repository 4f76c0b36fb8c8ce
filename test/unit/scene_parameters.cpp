// Parameters, settings, costs and places of a scene.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/scene/cost_kind.h"
#include "scene_texts.h"

using namespace costate;
using namespace costate::test;

namespace {
double number(const Scene& s, const std::string& path) {
  return s.mechanism()->numbers()[s.mechanism()->number(path)].value;
}

const Parameter& parameter(const Scene& s, const std::string& name) {
  for (const auto& p : s.mechanism()->parameters())
    if (p.name == name) return p;
  throw Error("no parameter " + name);
}

struct Third final : DualCostTerm<Third> {
  int weight = 0;
  template <class S>
  S physics(const CostArguments<S>& x) const {
    return x.numbers[weight] * x.q[0] * x.q[0] * x.q[0];
  }
};
}  // namespace

TEST_CASE("scene parameters: bindings, factors, bounds and scales") {
  const Scene s = Scene::parse(pendulum + R"(
[parameter.both]
numbers = ["bar.arm.mass_kg", "spring.S1.preload_N"]
factors = [4, -0.5]
upper = 7

[parameter.x]
number = "point.P.x_m"
scale = 0.25

[parameter.damping]
number = "spring.S1.damping_N_s_per_m"
)",
                               "s.toml", {"spring.S1.preload_N=-0.25", "bar.arm.length_m=1"});
  const Parameter& both = parameter(s, "both");
  REQUIRE(both.value == 0.5);
  REQUIRE(both.scale == 0.5);
  REQUIRE(both.lower == -std::numeric_limits<double>::infinity());
  REQUIRE(both.upper == 7);
  REQUIRE(both.bindings.size() == 2);
  const ParameterSelection selection = s.mechanism()->select({"both", "x", "damping", "spring.S1.natural_length_m"});
  auto numbers = s.mechanism()->base_numbers();
  const double rho[] = {2, 0.5, 0.1, 0.9};
  selection.apply(rho, numbers);
  REQUIRE(numbers[s.mechanism()->number("bar.arm.mass_kg")] == 8);
  REQUIRE(numbers[s.mechanism()->number("spring.S1.preload_N")] == -1);
  REQUIRE(numbers[s.mechanism()->number("point.P.x_m")] == 0.5);
  REQUIRE(parameter(s, "x").scale == 0.25);
  REQUIRE(parameter(s, "damping").scale == 1);  // its value is zero
  REQUIRE(s.mechanism()->default_parameters() == std::vector<std::string>{"k"});

  // All of them written back.
  const Scene changed = s.with_parameters(selection, {rho, rho + 4});
  REQUIRE(number(changed, "bar.arm.mass_kg") == 8);
  REQUIRE(number(changed, "spring.S1.preload_N") == -1);
  REQUIRE(number(changed, "point.P.x_m") == 0.5);
  REQUIRE(number(changed, "spring.S1.natural_length_m") == 0.9);
  REQUIRE(changed.mechanism()->select({"both", "x", "damping", "spring.S1.natural_length_m"}).values() ==
          std::vector<double>(rho, rho + 4));
}

TEST_CASE("scene parameters: the numbers that one binds must agree") {
  const std::string bound = pendulum + "\n[parameter.b]\nnumbers = [\"bar.arm.mass_kg\", \"spring.S1.preload_N\"]\n";
  REQUIRE(complaint(bound) ==
          "s.toml:46:1: parameter.b: 'spring.S1.preload_N' is 0 in the scene, but 'bar.arm.mass_kg' = 2 with "
          "factor 1 "
          "makes it 2. Numbers of one parameter must agree at the start.");
  REQUIRE(complaint(bound + "factors = [1, 1, 1]\n") ==
          "s.toml:48:11: 'factors' in [parameter.b] must hold one factor a number, found 3 for 2.");
  REQUIRE(complaint(bound + "factors = [0, 1]\n") == "s.toml:48:11: 'factors' in [parameter.b] must not hold a zero.");
  REQUIRE(complaint(bound + "factors = [1, 0]\n") == "s.toml:46:1: parameter.b: A factor must not be zero.");
  REQUIRE(complaint(bound + "factors = [1e-320, 1]\n") ==
          "s.toml:48:11: 'factors' in [parameter.b] make numbers too large to be held: the parameter's value is 2 / "
          "9.99989e-321 = inf, and 9.99989e-321 times that is inf.");
  REQUIRE(complaint(bound + "factors = [1, 2]\n", {"spring.S1.preload_N=4"}) == "no error");
}

TEST_CASE("scene parameters: numbers that cannot vary") {
  const auto bound_to = [](const std::string& path) {
    return complaint(pendulum + "\n[parameter.b]\nnumber = \"" + path + "\"\n",
                     {"bar.arm.length_m=1", "bar.light.from=A", "bar.light.to=Q", "bar.light.mass_kg=0",
                      "point.Q={ x_m = 1, y_m = 1 }", "start.given=['P.x', 'Q.x']"});
  };
  REQUIRE(bound_to("point.P.x_m") == "no error");
  REQUIRE(bound_to("point.P.y_m") ==
          "s.toml:46:1: parameter.b: 'point.P.y_m' cannot vary: it is only the first guess of coordinate "
          "'P.y', which the "
          "start solves for (given coordinates are listed in [start])");
  REQUIRE(bound_to("point.P.vy_m_per_s") ==
          "s.toml:46:1: parameter.b: 'point.P.vy_m_per_s' cannot vary: the start solves for the velocity of "
          "'P.y' (given "
          "velocities are listed in [start])");
  REQUIRE(bound_to("bar.light.mass_kg") ==
          "s.toml:46:1: parameter.b: 'bar.light.mass_kg' cannot vary: the bar is massless, a constraint "
          "without inertia; "
          "give it a mass to vary it");
  REQUIRE(complaint(pendulum, {"run.parameters=['point.P.y_m']"})
              .rfind("override 'run.parameters=['point.P.y_m']': run.parameters[0]: 'point.P.y_m' cannot vary:", 0) ==
          0);
}

TEST_CASE("scene parameters: every number in a law, a cost and a default can be one") {
  const Scene s = Scene::parse(pendulum, "s.toml",
                               {"spring.S1.spring_law={ kind='polynomial', coefficients=[0, 1, 2] }",
                                "cost.running[0].target={ kind='table', x=[0, 1, 2], y=[0.1, 0.2, 0.3] }",
                                "cost.terminal=[{ kind='value', output='P.y', target=3 }]"});
  REQUIRE(number(s, "spring.S1.spring_law.coefficients[2]") == 2);
  REQUIRE(number(s, "cost.running[0].target.y[1]") == 0.2);
  REQUIRE(number(s, "cost.terminal[0].target") == 3);
  REQUIRE(number(s, "cost.terminal[0].weight") == 1);
  REQUIRE(number(s, "bar.arm.length_m") == 1);
  for (const char* path : {"spring.S1.spring_law.coefficients[2]", "cost.running[0].target.y[1]",
                           "cost.terminal[0].target", "cost.terminal[0].weight", "bar.arm.length_m"}) {
    INFO(path);
    const auto selection = s.mechanism()->select({path});
    REQUIRE(number(s.with_parameters(selection, {0.75}), path) == 0.75);
  }
}

TEST_CASE("scene settings: defaults and everything set") {
  const Scene plain = Scene::parse(pendulum, "s.toml");
  REQUIRE(plain.title == "Pendulum");
  REQUIRE(plain.run.t_start_s == 0);
  REQUIRE(plain.run.formulation == "baumgarte");
  REQUIRE(plain.run.method == "idas-adjoint");
  REQUIRE(plain.run.integrator.empty());
  REQUIRE(plain.run.parameters == std::vector<std::string>{"k"});
  REQUIRE_FALSE(plain.run.atol);
  REQUIRE_FALSE(plain.run.output_step_s);
  REQUIRE_FALSE(plain.optimize.stop_value);
  REQUIRE(plain.optimize.algorithm == "mma");

  const Scene full = Scene::parse(
      pendulum, "s.toml",
      {"run.t_start_s=0.5", "run.formulation=penalty", "run.method=cvodes-forward", "run.integrator=cvodes",
       "run.rtol=1e-6", "run.atol=1e-9", "run.output_step_s=0.01", "run.outputs=['P.y', 'time']",
       "formulation.baumgarte_xi=2", "formulation.baumgarte_omega_rad_per_s=20", "formulation.penalty_xi=3",
       "formulation.penalty_omega_rad_per_s=30", "formulation.penalty_alpha=1e6", "optimize.max_evaluations=12",
       "optimize.stop_value=1e-13", "optimize.relative_tolerance=1e-7", "optimize.gradient_tolerance=1e-5",
       "optimize.constraint=[{ name='low', upper=2, running=[{ kind='square', output='P.y' }] }]"});
  REQUIRE(full.run.t_start_s == 0.5);
  REQUIRE(full.run.formulation == "penalty");
  REQUIRE(full.run.method == "cvodes-forward");
  REQUIRE(full.run.integrator == "cvodes");
  REQUIRE(full.run.rtol == 1e-6);
  REQUIRE(full.run.atol == 1e-9);
  REQUIRE(full.run.output_step_s == 0.01);
  REQUIRE(full.run.outputs == std::vector<std::string>{"P.y", "time"});
  REQUIRE(full.formulation.number("baumgarte_xi") == 2);
  REQUIRE(full.formulation.number("baumgarte_omega_rad_per_s") == 20);
  REQUIRE(full.formulation.number("penalty_xi") == 3);
  REQUIRE(full.formulation.number("penalty_omega_rad_per_s") == 30);
  REQUIRE(full.formulation.number("penalty_alpha") == 1e6);
  REQUIRE(full.optimize.max_evaluations == 12);
  REQUIRE(full.optimize.stop_value == 1e-13);
  REQUIRE(full.optimize.relative_tolerance == 1e-7);
  REQUIRE(full.optimize.gradient_tolerance == 1e-5);
  REQUIRE(full.constraints().size() == 1);
  REQUIRE(full.constraints()[0].name == "low");
  REQUIRE(full.constraints()[0].upper == 2);
  REQUIRE(full.constraints()[0].objective.running.size() == 1);
  REQUIRE(number(full, "optimize.constraint[0].running[0].weight") == 1);
}

TEST_CASE("scene costs: squares and values against numbers, laws and outputs") {
  const auto cost = [](const std::vector<std::string>& overrides) {
    const Scene s = Scene::parse(pendulum, "s.toml", overrides);
    Assembly assembly(s.mechanism(), s.mechanism()->select({}));
    const Start start = find_start(assembly, 0, false);
    StateView view;
    view.t = 0.5;
    view.q = start.q.data();
    view.v = start.v.data();
    return s.objective().running_value(view, assembly) + 100 * s.objective().terminal_value(view, assembly);
  };
  // P = (0.6, -0.8)
  REQUIRE(cost({}) == Approx(0.01));
  REQUIRE(cost({"cost.running[0].weight=3"}) == Approx(0.03));
  REQUIRE(cost({"cost.running[0].kind=value"}) == Approx(0.1));
  REQUIRE(cost({"cost.running=[{ kind='square', output='P.x' }]"}) == Approx(0.36));
  REQUIRE(cost({"cost.running[0].target=output:P.y"}) == Approx(1.96));
  REQUIRE(cost({"cost.running=[{ kind='square', output='P.x', target_output='P.y' }]"}) == Approx(1.96));
  REQUIRE(cost({"cost.running[0].target={ kind='polynomial', coefficients=[1, 2] }"}) == Approx(1.96));
  REQUIRE(cost({"cost.terminal=[{ kind='value', output='P.y', weight=2 }]"}) == Approx(0.01 - 160));
  REQUIRE(complaint(pendulum, {"cost.running[0].target_output='P.y'"}) ==
          "s.toml:37:10: 'target' in [cost.running[0]] contradicts 'target_output': give one of them.");
}

TEST_CASE("scene costs: a user's own kind is one registration") {
  static const RegisterCostKind registered({.name = "third-power-for-a-test",
                                            .summary = "weight q0^3",
                                            .read = [](SceneTable& table, MechanismBuilder& builder) -> MakeCostTerm {
                                              auto term = std::make_shared<Third>();
                                              term->weight = table.number("weight", builder, NumberRule::positive);
                                              return [term](const Mechanism&) { return term; };
                                            }});
  const std::vector<std::string> o = {"cost.running=[{ kind='third-power-for-a-test', weight=2 }]"};
  const Scene s = Scene::parse(pendulum, "s.toml", o);
  Assembly assembly(s.mechanism(), s.mechanism()->select({"cost.running[0].weight"}));
  const Start start = find_start(assembly, 0, false);
  StateView view;
  view.q = start.q.data();
  view.v = start.v.data();
  REQUIRE(s.objective().running_value(view, assembly) == Approx(2 * 0.216));
  ScalarGradient g;
  g.resize(assembly);
  s.objective().add_running_gradient(view, assembly, g);
  REQUIRE(g.q[0] == Approx(6 * 0.36));
  REQUIRE(g.rho[0] == Approx(0.216));
  REQUIRE(complaint(pendulum, {"cost.running=[{ kind='third-power-for-a-test', weight=0 }]"})
              .find("'weight' in [cost.running[0]] must be positive, found 0.") != std::string::npos);
}

TEST_CASE("scene places: every path is found, or the table it belongs to") {
  const Scene s = Scene::parse(pendulum, "s.toml");
  const auto at = [&](const std::string& path) {
    const SourceLocation w = s.locate(path);
    REQUIRE(w.file == "s.toml");
    return fmt::format("{}:{}", w.line, w.column);
  };
  REQUIRE(at("spring.S1.stiffness_N_per_m") == "23:21");
  REQUIRE(at("spring.S1.preload_N") == "20:1");
  REQUIRE(at("spring.S1") == "20:1");
  REQUIRE(at("spring.S9") == "0:0");
  REQUIRE(at("start") == "26:1");
  REQUIRE(at("start.given[0]") == "27:10");
  REQUIRE(at("cost.running[0].weight") == "34:1");
  REQUIRE(at("run.method") == "39:1");
  REQUIRE(at("") == "0:0");
  REQUIRE(at("not a [path") == "0:0");
}
