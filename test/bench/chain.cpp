#include "chain.h"

#include <fmt/format.h>

#include <cmath>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "support/sketch.h"

namespace costate::bench {

Problem make_chain(int bars, int parameters) {
  if (parameters < 0 || parameters > 2 * bars) throw Error("A chain has two parameters a bar.");
  const double step = planar_chain_point(1)[0];
  test::Sketch s;
  s.builder.set_gravity(0, -kChainGravity);
  s.ground("P0", 0, 0);
  std::vector<std::string> given;
  for (int i = 1; i <= bars; ++i) {
    const std::string from = fmt::format("P{}", i - 1), to = fmt::format("P{}", i), anchor = fmt::format("A{}", i);
    const auto [x, y, z] = planar_chain_point(i);
    const auto tie = planar_chain_anchor(i);
    s.point(to, x, y);
    s.ground(anchor, tie[0], tie[1]);
    s.bar(fmt::format("B{}", i), from, to, kChainMass);
    test::Sketch::Spring spring;
    spring.stiffness = kChainStiffness;
    spring.natural = kChainDepth;
    spring.damping = kChainDamping;
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

Problem make_spatial_chain(int bodies) {
  std::string text =
      fmt::format("[gravity]\ny_m_per_s2 = {}\n[point.P0]\nground = true\nx_m = 0\ny_m = 0\nz_m = 0\n", -kChainGravity);
  std::string given, rates;
  for (int i = 1; i <= bodies; ++i) {
    const auto from = spatial_chain_point(i - 1), tie = spatial_chain_anchor(i);
    text += fmt::format(
        "[rigid_body.B{0}]\nx_m = {1}\ny_m = {2}\nz_m = {3}\nmass_kg = {4}\ncenter_x_m = {5}\ninertia_xx_kg_m2 = {6}\n"
        "inertia_yy_kg_m2 = {7}\ninertia_zz_kg_m2 = {8}\n",
        i, from[0], from[1], from[2], kChainMass, kChainLength / 2, kSpatialInertia[0], kSpatialInertia[1],
        kSpatialInertia[2]);
    text += fmt::format(
        "[point.Q{0}]\non = \"B{0}\"\nx_m = 0\ny_m = 0\nz_m = 0\n[point.P{0}]\non = \"B{0}\"\nx_m = {1}\ny_m = 0\nz_m "
        "= "
        "0\n[point.A{0}]\nground = true\nx_m = {2}\ny_m = {3}\nz_m = {4}\n",
        i, kChainLength, tie[0], tie[1], tie[2]);
    text += fmt::format("[spherical.J{0}]\npoints = [\"P{1}\", \"Q{0}\"]\n", i, i - 1);
    text += fmt::format(
        "[spring.S{0}]\nfrom = \"P{0}\"\nto = \"A{0}\"\nstiffness_N_per_m = {1}\nnatural_length_m = {2}\n"
        "damping_N_s_per_m = {3}\n",
        i, kChainStiffness, kChainDepth, kChainDamping);
    for (int k = 1; k <= 3; ++k) given += fmt::format("\"B{}.e{}\", ", i, k);
    for (const char axis : {'x', 'y', 'z'}) rates += fmt::format("\"B{}.omega_{}\", ", i, axis);
  }
  text += fmt::format("[start]\ngiven = [{}]\ngiven_velocities = [{}]\n", given, rates);
  const auto end = spatial_chain_point(bodies);
  for (int d = 0; d < 3; ++d)
    text += fmt::format("[[cost.running]]\nkind = \"square\"\noutput = \"P{}.{}\"\ntarget = {}\n", bodies, "xyz"[d],
                        end[static_cast<std::size_t>(d)]);
  text += "[parameter.m]\nnumber = \"rigid_body.B1.mass_kg\"\n[run]\nt_end_s = 1\nformulation = \"baumgarte\"\n";
  return make_problem(Scene::parse(text, "spatial chain"), {});
}

}  // namespace costate::bench
