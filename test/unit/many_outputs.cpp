// Many outputs at once: those of names, and what the terms amount to that make them.
#include <support/paths.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/all_outputs.h"
#include "costate/problem/scene_problem.h"
#include "costate/tradeoff/trade_probe.h"

using namespace costate;
using Catch::Contains;

namespace {

const std::string kFiveBar = std::string(COSTATE_MODELS_DIR) + "/five_bar/five_bar.toml";

std::string message(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("many outputs: those of names, in their order, each as if it were made alone") {
  const auto m = Scene::load(kFiveBar).mechanism();
  std::vector<std::string> names = output_names(*m);
  std::reverse(names.begin(), names.end());
  names.push_back(names[3]);
  const auto outputs = make_outputs(*m, names);
  REQUIRE(outputs.size() == names.size());
  Assembly assembly(m, {});
  const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(m->coordinate_count(), 0.1, 0.9), v = 2 * q, a = 3 * q;
  const Eigen::VectorXd lambda = Eigen::VectorXd::LinSpaced(m->row_count(), 1, 2);
  const StateView s{0.5, q.data(), v.data(), a.data(), lambda.data(), nullptr};
  for (std::size_t i = 0; i < names.size(); ++i) {
    INFO(names[i]);
    const auto alone = make_output(*m, names[i]);
    CHECK(outputs[i]->name() == names[i]);
    CHECK(outputs[i]->unit() == alone->unit());
    CHECK(outputs[i]->value(s, assembly) == alone->value(s, assembly));
  }
  CHECK(make_outputs(*m, {}).empty());
  CHECK(message([&] { make_outputs(*m, {"P2.x", "P2.w"}); }) == message([&] { make_output(*m, "P2.w"); }));
}

TEST_CASE("many outputs: amounts are those of all coordinates") {
  // Of a formula that takes a coordinate twice, too: each counts once.
  const Scene scene = Scene::load(
      kFiveBar, {"output.sum.formula=\"P2.x + 0.1*P2.x_dot + S1.length\"", "output.sum.unit=\"m\"", "run.t_end_s=0.5"});
  const Problem problem = make_problem(scene);
  const std::vector<std::string> names = {"P2.x", "sum", "energy.kinetic", "S1.force", "P3.y"};
  const TradeProbe probe(problem, problem.parameters.values(), names, 4);
  const TradeMotion motion = *probe.run(problem, "").motion;
  std::vector<double> expected(names.size(), 0);
  simulate(problem, problem.parameters.values(), probe.times(), [&](const MechanismState& s, System& system) {
    for (std::size_t o = 0; o < names.size(); ++o) {
      ScalarGradient g;
      g.resize(system.assembly());
      probe.outputs()[o]->add_gradient(s, system.assembly(), 1, g);
      double amount = 0;
      for (Eigen::Index i = 0; i < g.q.size(); ++i) amount += std::abs(g.q[i] * s.q[i]) + std::abs(g.v[i] * s.v[i]);
      expected[o] = std::max(expected[o], amount);
    }
  });
  for (std::size_t o = 0; o < names.size(); ++o) {
    INFO(names[o]);
    CHECK(motion.amounts[o] > 0);
    CHECK(motion.amounts[o] == Approx(expected[o]).epsilon(1e-13));  // the same sums in another order
  }
}
