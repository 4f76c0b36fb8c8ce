#include "chain.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"
#include "support/sketch.h"

namespace costate::bench {

Problem make_chain(int bars, int parameters) {
  if (parameters < 0 || parameters > 2 * bars) throw Error("A chain has two parameters a bar.");
  constexpr double length = 0.2, mass = 0.1, depth = 1.0;  // m, kg, m
  const double step = length * std::sqrt(0.5);
  test::Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("P0", 0, 0);
  std::vector<std::string> given;
  for (int i = 1; i <= bars; ++i) {
    const std::string from = fmt::format("P{}", i - 1), to = fmt::format("P{}", i), anchor = fmt::format("A{}", i);
    const double x = step * i, y = -step * i;
    s.point(to, x, y);
    s.ground(anchor, x, y - depth);
    s.bar(fmt::format("B{}", i), from, to, mass);
    test::Sketch::Spring spring;
    spring.stiffness = 5;
    spring.natural = depth;
    spring.damping = 0.2;
    s.spring(fmt::format("S{}", i), to, anchor, spring);
    given.push_back(to + ".x");
  }
  s.give(given);
  std::vector<std::string> names;
  for (int j = 0; j < parameters; ++j) {
    const bool of_mass = j % 2 == 0;
    const int pairs = (parameters + 1) / 2, bar = 1 + (j / 2) * bars / pairs;
    const std::string name = fmt::format("{}{}", of_mass ? "mass" : "natural", bar);
    s.parameter(name, of_mass ? fmt::format("bar.B{}.mass_kg", bar) : fmt::format("spring.S{}.natural", bar));
    names.push_back(name);
  }
  const int weight = s.numbers("cost", {{"weight", 1}})[0];
  const test::Law x = test::polynomial({step * bars}), y = test::polynomial({-step * bars});
  const auto x_numbers = s.numbers("cost.x", x.keys), y_numbers = s.numbers("cost.y", y.keys);

  Problem problem;
  problem.mechanism = s.builder.build();
  if (!names.empty()) problem.parameters = problem.mechanism->select(names);
  const std::string end = fmt::format("P{}", bars);
  problem.objective.running = {std::make_shared<OutputTerm>(make_output(*problem.mechanism, end + ".x"), 2, weight,
                                                            OutputTerm::Target{x.law, x_numbers, nullptr}),
                               std::make_shared<OutputTerm>(make_output(*problem.mechanism, end + ".y"), 2, weight,
                                                            OutputTerm::Target{y.law, y_numbers, nullptr})};
  problem.formulation = "index1";
  problem.solver.t_end = 1;
  problem.solver.rtol = 1e-6;
  return problem;
}

}  // namespace costate::bench
