// Designs of limit cycles from outside: what models/walker says of the most stable gait at a speed, judged by cycles
// found anew beside it, which know neither gradients nor multipliers of Lagrange's.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "process.h"
#include "support/paths.h"

using costate::test::costate_json;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

namespace {

/// The largest modulus of the gait's multipliers, and its speed.
struct Gait {
  double multiplier, speed;
};

Gait gait(const std::string& scene, double slope, const std::vector<std::string>& sets, const WorkingDirectory& here) {
  std::vector<std::string> arguments = {"cycle", scene, "--no-files", "--no-derivatives", "--no-estimate"};
  for (const char* foot : {"left", "right"}) {
    arguments.insert(arguments.end(), {"--set", fmt::format("contact.{}.ground_angle_rad={:.16g}", foot, -slope)});
    for (const std::string& set : sets)
      if (set.rfind("body.", 0) != 0) {
        arguments.insert(arguments.end(), {"--set", set});
      } else {
        arguments.insert(arguments.end(), {"--set", fmt::format("body.{}{}", foot, set.substr(4))});
      }
  }
  const Json j = costate_json(arguments, here.path());
  double largest = 0;
  for (const Json& m : j.at("multipliers"))
    largest = std::max(largest, std::hypot(m[0].get<double>(), m[1].get<double>()));
  return {largest, j.at("speed_m_per_s")};
}

}  // namespace

// At the end the speed is the upper one, and all but the slope at bounds. So a faster gait would be more stable, and
// whatever is moved off its bound, with the slope for the same speed, less: by differences over a few hundredths of
// what a parameter may be, and of cycles whose multipliers are known to 1e-6 without a second search.
TEST_CASE("cycle designs: the most stable gait keeps its speed, and no other at that speed is more stable") {
  const WorkingDirectory here;
  // Not far from the end, which takes a third of the time: the end is the same.
  std::vector<std::string> run = {"optimize", COSTATE_MODELS_DIR "/walker/gait_stability.toml", "--no-certificate",
                                  "--output", "out"};
  for (const char* set :
       {"contact.left.ground_angle_rad=-0.0096", "contact.right.ground_angle_rad=-0.0096", "body.left.mass_kg=1.9",
        "body.right.mass_kg=1.9", "torsion_spring.hip.stiffness_N_m_per_rad=0.001"})
    run.insert(run.end(), {"--set", set});
  const Json j = costate_json(run, here.path());
  CHECK(j.at("converged") == true);
  CHECK(j.at("psi").get<double>() == Approx(0.5637504).epsilon(1e-6));
  for (const Json& constraint : j.at("constraints")) {
    const double speed = std::abs(constraint.at("psi").get<double>());
    CHECK(constraint.at("psi").get<double>() <= constraint.at("upper").get<double>() + 1e-9);
    CHECK(speed == Approx(0.1047).epsilon(1e-8));
  }
  const Json& at = j.at("parameters");
  CHECK(at.at("foot_mass").get<double>() == Approx(2).epsilon(1e-9));
  for (const char* zero : {"leg_center", "stiffness", "damping"}) CHECK(std::abs(at.at(zero).get<double>()) < 1e-9);

  const double slope = at.at("slope"), step = 1e-5, speed = 0.1047;
  const std::string scene = "out/optimized.toml";
  const Gait best = gait(scene, slope, {}, here), steeper = gait(scene, slope + step, {}, here);
  CHECK(best.multiplier == Approx(j.at("psi").get<double>()).epsilon(2e-6));
  CHECK(best.speed == Approx(speed).epsilon(1e-7));
  const double by_speed = (steeper.speed - best.speed) / step;
  // What psi gains by a unit of that bound; the certificate of the whole has 2.2965.
  CHECK((best.multiplier - steeper.multiplier) / (steeper.speed - best.speed) == Approx(2.2965).epsilon(2e-3));

  struct Move {
    std::vector<std::string> sets;
    double by, multiplier;  // of its bound, as that certificate has it
  };
  const Move moves[] = {{{"body.mass_kg=1.95"}, 0.05, 0.010358},
                        {{"body.center_y_m=0.002"}, 0.002, 0.33258},
                        {{"torsion_spring.hip.stiffness_N_m_per_rad=0.002"}, 0.002, 0.14293},
                        {{"torsion_spring.hip.damping_N_m_s_per_rad=0.0005"}, 0.0005, 2.10036}};
  for (const Move& move : moves) {
    CAPTURE(move.sets);
    double s = slope;
    Gait g = gait(scene, s, move.sets, here);
    for (int k = 0; k < 3 && std::abs(g.speed - speed) > 1e-9; ++k)
      g = gait(scene, s += (speed - g.speed) / by_speed, move.sets, here);
    CHECK(g.speed == Approx(speed).epsilon(1e-6));
    CHECK(g.multiplier > best.multiplier);
    CHECK((g.multiplier - best.multiplier) / move.by == Approx(move.multiplier).epsilon(0.05));
  }
}
