#include <support/costs.h>
#include <support/models.h>
#include <support/sketch.h>

#include <cmath>

namespace costate::test {

namespace {
constexpr double kGravity = 9.81;  // m/s^2
}

Problem TestModel::problem(const std::string& formulation, double rtol,
                           const std::vector<std::string>& parameters) const {
  Problem p;
  p.mechanism = mechanism;
  p.parameters = mechanism->select(parameters);
  p.objective = objective;
  p.formulation = formulation;
  p.solver.rtol = rtol;
  p.solver.t_end = t_end;
  return p;
}

ParameterSelection TestModel::all_parameters() const {
  std::vector<std::string> names;
  for (const auto& p : mechanism->parameters()) names.push_back(p.name);
  return mechanism->select(names);
}

TestModel five_bar(FiveBarGeometry geometry) {
  const bool hanging = geometry == FiveBarGeometry::hanging;
  Sketch s;
  s.builder.set_gravity(0, -kGravity);
  s.ground("A", 0, 0);
  s.ground("B", 1, 0);
  if (hanging) {
    s.point("P1", -1, -1);
    s.point("P2", 0.5, -2);
    s.point("P3", 2, -1);
  } else {
    s.point("P1", -0.5, 1);
    s.point("P2", 0.5, 2);
    s.point("P3", 1.5, 1);
    s.ground("C", -0.5, 0);
  }
  s.bar("A1", "A", "P1", 1);
  s.bar("B12", "P1", "P2", 1.5);
  s.bar("B23", "P2", "P3", 1.5);
  s.bar("B3B", "P3", "B", 1);
  const std::string ends[2][2] = {{hanging ? "A" : "C", hanging ? "P3" : "P2"}, {hanging ? "A" : "B", "P2"}};
  const double natural[2] = {std::sqrt(5.0), std::sqrt(4.25)};
  for (int i = 0; i < 2; ++i) {
    const std::string k = std::to_string(i + 1);
    s.spring("S" + k, ends[i][0], ends[i][1], {.stiffness = 100, .natural = natural[i], .spring = {}, .damper = {}});
    s.parameter("L0" + k, "spring.S" + k + ".natural");
    s.parameter("k" + k, "spring.S" + k + ".stiffness");
  }
  const char* const bars[4] = {"A1", "B12", "B23", "B3B"};
  for (int i = 0; i < 4; ++i) s.parameter("m" + std::to_string(i + 1), std::string("bar.") + bars[i] + ".mass_kg");
  s.parameter("A1_length", "bar.A1.length_m");
  s.give({"P2.x", "P2.y"});
  s.numbers("cost", {{"weight", 1}, {"x", 0.5}, {"y", hanging ? -2 : 2}});
  s.builder.set_default_parameters({"L01", "L02"});
  TestModel m{hanging ? "five-bar" : "standing five-bar", s.builder.build(), {}, 5};
  const auto constant = std::make_shared<PolynomialLaw>(1);
  m.objective.running = {output_term(*m.mechanism, "P2.x", 2, "cost.weight", constant, {"cost.x"}),
                         output_term(*m.mechanism, "P2.y", 2, "cost.weight", constant, {"cost.y"})};
  return m;
}

TestModel chain(int bars, double t_end) {
  Sketch s;
  s.builder.set_gravity(0, -kGravity);
  s.ground("P0", 0, 0);
  std::vector<std::string> names;
  for (int i = 1; i <= bars; ++i) {
    const std::string k = std::to_string(i), point = "P" + k;
    s.point(point, 0.08 * i, -0.06 * i);
    s.bar("B" + k, "P" + std::to_string(i - 1), point, 0.2);
    s.parameter("m" + k, "bar.B" + k + ".mass_kg");
    s.give({point + ".x"});
    names.push_back("m" + k);
  }
  s.numbers("cost", {{"weight", 1}});
  s.builder.set_default_parameters(names);
  TestModel m{"chain", s.builder.build(), {}, t_end};
  m.objective.running = {output_term(*m.mechanism, "P" + std::to_string(bars) + ".y", 2, "cost.weight")};
  return m;
}

TestModel pendulum(double side, double t_end) {
  Sketch s;
  s.builder.set_gravity(0, -kGravity);
  s.ground("O", 0, 0);
  s.point("P", side, 0);
  s.mass("P", 1);
  s.distance("rod", "O", "P");
  s.give({"P.y"});
  s.numbers("cost", {{"weight", 1}, {"y", -1}});
  s.parameter("g", {{"gravity.y_m_per_s2", -1.0}});
  // The lowest point moves with the length.
  s.parameter("L", {{"distance.rod.length_m", 1.0}, {"cost.y", -1.0}});
  s.builder.set_default_parameters({"g", "L"});
  TestModel m{"pendulum", s.builder.build(), {}, t_end};
  m.objective.running = {
      output_term(*m.mechanism, "P.y", 2, "cost.weight", std::make_shared<PolynomialLaw>(1), {"cost.y"})};
  return m;
}

TestModel four_bars(int windows, double t_end) {
  Sketch s;
  s.builder.set_gravity(0, -kGravity);
  for (int i = 0; i <= windows; ++i) {
    const std::string k = std::to_string(i);
    s.ground("A" + k, i, 0);
    s.point("B" + k, i, 1, 1, 0);
  }
  for (int i = 0; i <= windows; ++i) {
    const std::string k = std::to_string(i);
    s.bar("post" + k, "A" + k, "B" + k, 1);
    if (i > 0) s.bar("lintel" + k, "B" + std::to_string(i - 1), "B" + k, 1);
  }
  s.give({"B0.x"});
  s.numbers("cost", {{"weight", 1}});
  s.parameter("g", {{"gravity.y_m_per_s2", -1.0}});
  s.parameter("speed", "point.B0.vx_m_per_s");
  s.builder.set_default_parameters({"g", "speed"});
  TestModel m{"four-bars", s.builder.build(), {}, t_end};
  m.objective.running = {output_term(*m.mechanism, "B0.x", 2, "cost.weight")};
  return m;
}

TestModel free_flight() {
  Sketch s;
  s.builder.set_gravity(0, -kGravity);
  s.ground("O", 0, 1);
  s.body("stick", {0.3, 0.2, 0.4}, {0.5, 1.0, -2.0}, 1.5, 0.2, 0.1, -0.2);
  s.attach("tip", "stick", 0.5, 0.1);
  s.point("M", 1.4, -0.3, -0.5, 0.8);
  s.mass("M", 0.6);
  s.spring("S", "tip", "M", {.stiffness = 20, .natural = 0.7, .damping = 0.5, .spring = {}, .damper = {}});
  s.maxwell("relaxation", "O", "tip", 15, 0.9, 4, 0.1);
  s.couple("push", {"stick.angle"}, sine(0.3, 1.0, 4.0, 0.2));
  s.give({"stick.x", "stick.y", "stick.angle", "M.x", "M.y"});
  s.numbers("cost", {{"weight", 0.8}, {"target", 0.4}});
  s.parameter("stick_inertia", "body.stick.inertia_kg_m2");
  s.parameter("tip_x", "point.tip.x_m");
  s.parameter("stiffness", "spring.S.stiffness");
  s.parameter("damping", "maxwell.relaxation.damping");
  s.parameter("start_rate", "body.stick.rate_rad_per_s");
  s.parameter("target", "cost.target");
  s.builder.set_default_parameters({"stick_inertia", "tip_x", "stiffness", "damping", "start_rate", "target"});
  TestModel m{"free flight", s.builder.build(), {}, 1};
  const EverythingCost::Factors factors{1, 0.3, 0.05, 0, 2};
  m.objective.running = {std::make_shared<EverythingCost>(*m.mechanism, "cost.weight", "cost.target", factors)};
  m.objective.terminal = m.objective.running;
  return m;
}

namespace {

TestModel kitchen_sink(bool accelerations) {
  Sketch s;
  s.builder.set_gravity(0, -kGravity);
  // A driven crank with an angle, and a rod of general inertia.
  s.ground("O", 0, 0);
  s.point("P", 0.6, 0.8);
  s.point("R", 1.6, 0.5, 0, 0.3);
  s.bar("crank", "O", "P", 1.2);
  s.bar("rod", "P", "R", 0.9, 0.45, 0.1);
  s.angle("crank_angle", "O", "P", 0.93);
  s.driver("motor", {{"crank_angle", 1.0}}, sine(0.9, 0.3, 3.0, 0.1));
  // A plate with its mass off the reference point: hinged to the rod, a hole of it sliding on a line of the ground.
  s.ground("W1", 1.8, 1.2);
  s.ground("W2", 3.0, 0.4);
  s.body("plate", {2.01, 0.48, 0.2}, {0, 0, 0}, 2.0, 0.15, 0.1, -0.05);
  s.attach("corner", "plate", -0.4, 0.1);
  s.attach("hole", "plate", 0.5, 0.2);
  s.attach("horn", "plate", 0.3, -0.35);
  s.revolute("hinge", "R", "corner");
  s.slot("slot", "W1", "W2", "hole");
  // A bob hung from a point of the rod.
  s.attach("eye", "rod", 0.7, 0.1);
  s.point("M", 1.9, -0.7, -0.4, 0.1);
  s.mass("M", 0.7);
  s.distance("string", "eye", "M");
  // A flag on the ground, with an angle and a point of its own.
  s.ground("G", -0.4, 0.2);
  s.point("F", -1.0, -0.5, 0.2, 0);
  s.bar("flag", "F", "G", 0.8);
  s.angle("flag_angle", "F", "G", 0.86);
  s.attach("flag_tip", "flag", -0.2, 0.15);
  // A boom lifted by a ram of given stroke.
  s.ground("H1", -0.5, -1.5);
  s.ground("H2", -0.5, -0.9);
  s.point("K", 0.3, -1.1);
  s.bar("boom", "H1", "K", 0.6);
  s.attach("boom_eye", "boom", 0.5, 0.1);
  s.distance_driver("stroke", "H2", "boom_eye", polynomial({0.5, 0.1, -0.05}));
  // A block that keeps its direction and is geared to the flag.
  s.ground("V1", -2.0, 0.0);
  s.ground("V2", -2.18, 1.0);
  s.body("block", {-1.5, 0.3, 0.1}, {0, -0.3, 0}, 1.1, 0.08, 0.05, 0.1);
  s.attach("b1", "block", -0.3, 0.0);
  s.attach("b2", "block", 0.3, 0.05);
  s.perpendicular("upright", "b1", "b2", "V1", "V2");
  s.driver("gear", {{"block.x", 1.0}, {"flag_angle", 0.4}}, polynomial({-1.155}));

  s.ground("U", 2.5, -0.4);
  s.attach("crank_eye", "crank", 0.5, -0.1);
  s.spring("S1", "U", "horn",
           {.stiffness = 40,
            .natural = 0.6,
            .damping = 0.8,
            .preload = 0.5,
            .spring = table({-0.5, -0.2, 0, 0.2, 0.5}, {-8, -2, 0, 2.5, 9}),
            .damper = polynomial({0, 0, 0, 0.3})});
  s.spring("S2", "V1", "b2", {.stiffness = 25, .natural = 0.7, .damping = 0.5, .spring = {}, .damper = {}});
  s.spring("S3", "K", "M", {.stiffness = 8, .natural = 1.2, .damping = 0.2, .spring = {}, .damper = {}});
  s.maxwell("relaxation", "M", "crank_eye", 30, 1.2, 6, 0.05);
  s.lag_actuator("actuator", "flag_tip", "b1", 0.15, 1.5, sine(2, 3, 4, 0.2));
  s.torsion("twist", {"flag_angle", "plate.angle"},
            {.stiffness = 3, .natural = -0.5, .damping = 0.4, .spring = polynomial({0, 0, 0.5, 0.8}), .damper = {}});
  s.torsion_maxwell("twist_relaxation", {"plate.angle"}, 4, 0.1, 2, 0.02);
  s.torsion_maxwell("relative_relaxation", {"block.angle", "flag_angle"}, 2, 0.5, 1.5, -0.1);
  s.point_force("wind", "hole", sine(0.5, 1.5, 5, 0.3), smooth_step(0.2, 0.8, 0.0, -3));
  s.couple("drive", {"flag_angle", "plate.angle"}, polynomial({0.2, 0.5, -0.3}));
  s.give({"R.y", "M.x", "F.x", "block.y"});

  s.numbers("cost", {{"run", 0.7},
                     {"run_target", 0.9},
                     {"end", 0.4},
                     {"end_target", 1.3},
                     {"track", 0.5},
                     {"track0", 0.6},
                     {"track1", 0.8},
                     {"track2", 0.7},
                     {"force", 0.003},
                     {"energy", 0.02},
                     {"reaction", 0.002},
                     {"difference", 0.6}});

  // Masses: one alone, two tied by a ratio, inertia and centre of the off-centre body, of the general bar.
  s.parameter("bob_mass", "mass.M.mass_kg");
  s.parameter("bar_mass", {{"bar.crank.mass_kg", 1.0}, {"bar.flag.mass_kg", 0.8 / 1.2}});
  s.parameter("plate_mass", "body.plate.mass_kg");
  s.parameter("plate_inertia", "body.plate.inertia_kg_m2");
  s.parameter("plate_centre_x", "body.plate.centre_x_m");
  s.parameter("plate_centre_y", "body.plate.centre_y_m");
  s.parameter("rod_inertia", "bar.rod.inertia_kg_m2");
  s.parameter("rod_centre", "bar.rod.centre_m");
  // Lengths (the start moves with them) and attachment points.
  s.parameter("crank_length", "bar.crank.length_m");
  s.parameter("rod_length", "bar.rod.length_m");
  s.parameter("flag_length", "bar.flag.length_m");
  s.parameter("string_length", "distance.string.length_m");
  s.parameter("eye_along", "point.eye.x_m");
  s.parameter("corner_y", "point.corner.y_m");
  s.parameter("hole_x", "point.hole.x_m");
  s.parameter("ground_x", "point.W1.x_m");
  s.parameter("ground_y", "point.V2.y_m");
  // Laws of forces and drivers.
  s.parameter("natural", "spring.S1.natural");
  s.parameter("table", "spring.S1.spring.y3");
  s.parameter("cubic_damping", "spring.S1.damper.c3");
  s.parameter("block_damping", "spring.S2.damping");
  s.parameter("torsion_cubic", "torsion.twist.spring.c3");
  s.parameter("motor_amplitude", "driver.motor.amplitude");
  s.parameter("motor_frequency", "driver.motor.omega");
  s.parameter("gear_ratio", "driver.gear.weight.flag_angle");
  s.parameter("stroke_rate", "driver.stroke.c1");
  s.parameter("wind_step", "force.wind.y.y1");
  s.parameter("couple_rate", "couple.drive.c1");
  // Force states and their starts.
  s.parameter("relaxation_damping", "maxwell.relaxation.damping");
  s.parameter("relaxation_start", "maxwell.relaxation.state");
  s.parameter("lag", "actuator.actuator.tau");
  s.parameter("lag_start", "actuator.actuator.state");
  s.parameter("command", "actuator.actuator.command.amplitude");
  // Starts, gravity and the cost's own numbers.
  s.parameter("start_R_y", "point.R.y_m");
  s.parameter("start_F_vx", "point.F.vx_m_per_s");
  s.parameter("g", {{"gravity.y_m_per_s2", -1.0}});
  s.parameter("run_weight", "cost.run");
  s.parameter("end_target", "cost.end_target");
  s.parameter("track1", "cost.track1");

  TestModel m{accelerations ? "kitchen sink" : "kitchen sink without accelerations", s.builder.build(), {}, 1};
  const Mechanism& mech = *m.mechanism;
  const double a = accelerations ? 0.05 : 0, l = accelerations ? 0.02 : 0;
  m.objective.running = {
      std::make_shared<EverythingCost>(mech, "cost.run", "cost.run_target", EverythingCost::Factors{1, 0.3, a, l, 2}),
      output_term(mech, "hole.x", 2, "cost.track", std::make_shared<TableLaw>(std::vector<double>{0, 0.4, 1.1}),
                  {"cost.track0", "cost.track1", "cost.track2"}),
      output_term(mech, "S1.force", 2, "cost.force"), output_term(mech, "energy.kinetic", 1, "cost.energy"),
      output_difference(mech, "eye.y", "boom_eye.x_dot", "cost.difference")};
  m.objective.terminal = {std::make_shared<EverythingCost>(mech, "cost.end", "cost.end_target",
                                                           EverythingCost::Factors{0.5, 0.4, 0.6 * a, 1.5 * l, 1}),
                          output_term(mech, "relaxation.force", 2, "cost.force"),
                          output_difference(mech, "flag_tip.x", "corner.y_dot", "cost.difference")};
  if (accelerations) {
    m.objective.running.push_back(output_term(mech, "hinge.reaction_x", 2, "cost.reaction"));
    m.objective.running.push_back(output_term(mech, "horn.y_ddot", 2, "cost.reaction"));
    m.objective.terminal.push_back(output_term(mech, "string.tension", 2, "cost.reaction"));
    m.objective.terminal.push_back(output_difference(mech, "horn.x_ddot", "rod.tension", "cost.reaction"));
  }
  return m;
}

}  // namespace

TestModel kitchen_sink() { return kitchen_sink(true); }
TestModel kitchen_sink_without_accelerations() { return kitchen_sink(false); }

}  // namespace costate::test
