// Mechanisms that turn all the way round, so that no choice of independent coordinates serves for a whole run.
#pragma once

#include <support/costs.h>
#include <support/models.h>
#include <support/sketch.h>

#include <cmath>

namespace costate::test {

/// A point mass on a rod of 1 m, set off from the lowest point at `speed` m/s (more than 6.26: it goes over the top).
/// psi = integral of (x - 0.3)^2 + 1e-4 tension^2, and y_ddot^2/100 at the end. Parameters: g, speed, L.
inline TestModel spinning_pendulum(double speed, double t_end) {
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("O", 0, 0);
  s.point("P", 0, -1, speed, 0);
  s.mass("P", 1);
  s.distance("rod", "O", "P");
  s.give({"P.x"});
  s.numbers("cost", {{"weight", 1}, {"x", 0.3}, {"force", 1e-4}, {"end", 0.01}});
  s.parameter("g", {{"gravity.y_m_per_s2", -1.0}});
  s.parameter("speed", "point.P.vx_m_per_s");
  s.parameter("L", "distance.rod.length_m");
  s.builder.set_default_parameters({"g", "speed", "L"});
  TestModel m{"spinning pendulum", s.builder.build(), {}, t_end};
  m.objective.running = {
      output_term(*m.mechanism, "P.x", 2, "cost.weight", std::make_shared<PolynomialLaw>(1), {"cost.x"}),
      output_term(*m.mechanism, "rod.tension", 2, "cost.force")};
  m.objective.terminal = {output_term(*m.mechanism, "P.y_ddot", 2, "cost.end")};
  return m;
}

/// Crank 0.3 m, coupler 1 m, rocker 0.8 m, ground 0.9 m, set off at 6 m/s of the crank pin: 3 turns a second.
/// psi = integral of R.x^2 and 1e-4 (tension of the coupler)^2. Parameters: g, speed, crank and rocker length, mass.
inline TestModel crank_rocker(double t_end) {
  const double crank = 0.3, coupler = 1, rocker = 0.8, ground = 0.9;
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("O", 0, 0);
  s.ground("G", ground, 0);
  // The crank upright; R on the circles about P and G.
  const double d = std::hypot(ground, crank), along = (coupler * coupler - rocker * rocker + d * d) / (2 * d),
               across = std::sqrt(coupler * coupler - along * along), ux = ground / d, uy = -crank / d;
  s.point("P", 0, crank, 6, 0);
  s.point("R", along * ux - across * uy, crank + along * uy + across * ux);
  s.bar("crank", "O", "P", 2);
  s.bar("coupler", "P", "R", 0.5);
  s.bar("rocker", "G", "R", 0.5);
  s.give({"P.x"});
  s.numbers("cost", {{"weight", 1}, {"force", 1e-4}});
  s.parameter("g", {{"gravity.y_m_per_s2", -1.0}});
  s.parameter("speed", "point.P.vx_m_per_s");
  s.parameter("crank_length", "bar.crank.length_m");
  s.parameter("rocker_length", "bar.rocker.length_m");
  s.parameter("coupler_mass", "bar.coupler.mass_kg");
  s.builder.set_default_parameters({"g", "speed", "crank_length", "rocker_length", "coupler_mass"});
  TestModel m{"crank-rocker", s.builder.build(), {}, t_end};
  m.objective.running = {output_term(*m.mechanism, "R.x", 2, "cost.weight"),
                         output_term(*m.mechanism, "coupler.tension", 2, "cost.force")};
  return m;
}

/// Crank 0.4 m, rod 1 m, a slider of 1 kg on the x axis against a damped spring with a relaxing branch; a moment that
/// varies with time drives the crank. psi = integral of slider.x^2, and its velocity squared at the end.
inline TestModel slider_crank(double t_end) {
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("O", 0, 0);
  s.ground("X1", 0.2, 0);
  s.ground("X2", 2.5, 0);
  s.point("P", 0, 0.4, -5, 0);
  s.point("Q", std::sqrt(1 - 0.16), 0);
  s.bar("crank", "O", "P", 2);
  s.bar("rod", "P", "Q", 0.6);
  s.mass("Q", 1);
  s.slot("guide", "X1", "X2", "Q");
  s.spring("S", "Q", "X2", {.stiffness = 20, .natural = 1.2, .damping = 0.5, .spring = {}, .damper = {}});
  s.maxwell("relaxation", "Q", "X2", 15, 1.3, 2, 0.1);
  s.point_force("push", "P", sine(0, 2, 3, 0.4), sine(1, 2, 5, 0.1));
  s.give({"P.x"});
  s.numbers("cost", {{"weight", 1}, {"end", 0.1}});
  s.parameter("speed", "point.P.vx_m_per_s");
  s.parameter("crank_length", "bar.crank.length_m");
  s.parameter("stiffness", "spring.S.stiffness");
  s.parameter("relaxation", "maxwell.relaxation.damping");
  s.parameter("state", "maxwell.relaxation.state");
  s.builder.set_default_parameters({"speed", "crank_length", "stiffness", "relaxation", "state"});
  TestModel m{"slider-crank", s.builder.build(), {}, t_end};
  m.objective.running = {output_term(*m.mechanism, "Q.x", 2, "cost.weight")};
  m.objective.terminal = {output_term(*m.mechanism, "Q.x_dot", 2, "cost.end")};
  return m;
}

/// Three posts of 1 m under one lintel: the one in the middle says nothing new. psi = integral of D.x^2 and, on
/// request, of the middle post's force. Parameters: g, speed, mass of the lintel, the height of all posts.
inline TestModel parallelogram(bool middle_post, bool force, double t_end) {
  Sketch s;
  s.builder.set_gravity(0, -9.81);
  s.ground("A", 0, 0);
  s.ground("B", 1, 0);
  s.ground("C", 0.4, 0);
  const double h = std::sqrt(0.75);
  s.point("D", 0.5, h, 2 * h, -1);
  s.point("E", 1.5, h, 2 * h, -1);
  s.bar("left", "A", "D", 1);
  s.bar("right", "B", "E", 1.3);
  s.bar("lintel", "D", "E", 2);
  s.attach("M", "lintel", 0.4, 0);
  std::vector<std::pair<std::string, double>> heights = {{"bar.left.length_m", 1.0}, {"bar.right.length_m", 1.0}};
  if (middle_post) {
    s.distance("middle", "C", "M");
    heights.emplace_back("distance.middle.length_m", 1.0);
  }
  s.spring("S", "B", "D", {.stiffness = 40, .natural = 0.8, .damping = 0.3, .spring = {}, .damper = {}});
  s.give({"D.x"});
  s.numbers("cost", {{"weight", 1}, {"force", 0.01}});
  s.parameter("g", {{"gravity.y_m_per_s2", -1.0}});
  s.parameter("mass", "bar.lintel.mass_kg");
  s.parameter("height", heights);
  s.parameter("stiffness", "spring.S.stiffness");
  s.builder.set_default_parameters({"g", "mass", "height", "stiffness"});
  TestModel m{"parallelogram", s.builder.build(), {}, t_end};
  m.objective.running = {output_term(*m.mechanism, "D.x", 2, "cost.weight")};
  if (force) m.objective.running.push_back(output_term(*m.mechanism, "middle.tension", 2, "cost.force"));
  return m;
}

}  // namespace costate::test
