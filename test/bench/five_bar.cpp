#include "five_bar.h"

#include <cmath>

#include "support/sketch.h"

namespace costate::bench {

Problem make_five_bar() {
  test::Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("A", 0, 0);
  s.ground("B", 1, 0);
  s.ground("C", -0.5, 0);
  s.point("P1", -0.5, 1);
  s.point("P2", 0.5, 2);
  s.point("P3", 1.5, 1);
  s.bar("A1", "A", "P1", 1);
  s.bar("12", "P1", "P2", 1.5);
  s.bar("23", "P2", "P3", 1.5);
  s.bar("3B", "P3", "B", 1);
  test::Sketch::Spring spring;
  spring.stiffness = 100;
  spring.natural = std::sqrt(5.0);
  s.spring("S1", "P2", "C", spring);
  spring.natural = std::sqrt(4.25);
  s.spring("S2", "P2", "B", spring);
  s.parameter("L01", "spring.S1.natural");
  s.parameter("L02", "spring.S2.natural");
  s.give({"P1.x", "P3.x"});
  const int weight = s.numbers("cost", {{"weight", 1}})[0];
  const test::Law x = test::polynomial({0.5}), y = test::polynomial({2.0});
  const auto x_numbers = s.numbers("cost.x", x.keys), y_numbers = s.numbers("cost.y", y.keys);

  Problem problem;
  problem.mechanism = s.builder.build();
  problem.parameters = problem.mechanism->select({"L01", "L02"});
  problem.objective.running = {std::make_shared<OutputTerm>(make_output(*problem.mechanism, "P2.x"), 2, weight,
                                                            OutputTerm::Target{x.law, x_numbers, nullptr}),
                               std::make_shared<OutputTerm>(make_output(*problem.mechanism, "P2.y"), 2, weight,
                                                            OutputTerm::Target{y.law, y_numbers, nullptr})};
  problem.formulation = "index1";
  problem.solver.t_end = five_bar::t_end;
  return problem;
}

double psi_error(double psi) { return std::abs(psi / five_bar::psi - 1); }

double gradient_error(const std::vector<double>& gradient) {
  const auto& r = five_bar::gradient;
  return std::hypot(gradient[0] - r[0], gradient[1] - r[1]) / std::hypot(r[0], r[1]);
}

}  // namespace costate::bench
