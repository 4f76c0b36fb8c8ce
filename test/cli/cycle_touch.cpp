// Cycles whose section is the touch of a rigid contact: the run ends as something strikes, as it is meant to.
#include <catch2/catch.hpp>
#include <cmath>

#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

TEST_CASE("cycle: a section where a foot strikes is no end that rounding decides") {
  const WorkingDirectory here;
  const std::string scene = COSTATE_SOURCE_DIR "/test/cases/compass_on_touch.toml";
  const Json j = costate_json({"cycle", scene, "--no-files"}, here.path());
  CHECK(j.at("warnings").empty());
  // Of an own program in minimal coordinates (scipy, DOP853 with events).
  CHECK(j.at("period_s").get<double>() == Approx(0.73556).margin(1e-5));
  // What does not come again says so in the words of the scene.
  const Json late = costate_json({"cycle", scene, "--t-end", "0.7", "--no-files"}, here.path(), 1);
  CHECK_THAT(late.at("error").get<std::string>(),
             Contains("'contact.left touch', its section, does not come again between") && Contains("t_end_s = 0.7 s"));
}

TEST_CASE("cycle: a cost of accelerations where it ends has a gradient") {
  const WorkingDirectory here;
  const std::string scene = COSTATE_SOURCE_DIR "/test/cases/compass_on_touch.toml";
  const auto gradient = [&](const std::string& method) {
    return costate_json({"gradient", scene, "--set", "run.cycle=true", "--method", method, "--no-files"}, here.path());
  };
  const Json exact = gradient("differences");
  for (const char* method : {"cvodes-adjoint", "cvodes-forward", "idas-adjoint"}) {
    CAPTURE(method);
    const Json j = gradient(method);
    // At rtol 1e-10; differences state 1e-9.
    for (const auto& [name, value] : exact.at("gradient").items())
      CHECK(j.at("gradient").at(name).get<double>() == Approx(value.get<double>()).epsilon(1e-6));
  }
}

// The start hangs in the air, where no force depends on time.
TEST_CASE("cycle: a ball on a post that moves has the post's period") {
  const WorkingDirectory here;
  const std::string scene = COSTATE_SOURCE_DIR "/test/cases/ball_on_a_post.toml";
  const Json j = costate_json({"gradient", scene, "--no-files"}, here.path());
  // Of an own program (events of scipy's DOP853, Newton's method on the return map).
  CHECK(j.at("psi").get<double>() == Approx(0.354485253).epsilon(1e-6));
  const Json other = costate_json({"cycle", scene, "--set", "cycle.period_s=0.2", "--no-files"}, here.path(), 1);
  CHECK_THAT(other.at("error").get<std::string>(), Contains("this is no period of theirs"));
  const Json moved = costate_json(
      {"gradient", scene, "--parameters", "road.r.law.angular_frequency_rad_per_s", "--no-files"}, here.path(), 1);
  CHECK_THAT(moved.at("error").get<std::string>(), Contains("changes the period of the forces"));
  const Json section =
      costate_json({"cycle", scene, "--set", "cycle={section=\"f touch\"}", "--no-files"}, here.path(), 1);
  CHECK(section.at("status") != "ok");
}

// Only the value of the driver's law is another after a turn.
TEST_CASE("cycle: a crank that a driver turns comes round") {
  const WorkingDirectory here;
  const std::string scene = COSTATE_SOURCE_DIR "/test/cases/driven_crank.toml";
  const Json j = costate_json({"cycle", scene, "--no-files", "--rtol", "1e-10"}, here.path());
  // The mass goes round on a circle of 0.8857143 m, the multipliers by scipy (DOP853, 1e-12).
  CHECK(j.at("fixed_point").at("Q.x").get<double>() == Approx(0.885714286).epsilon(1e-7));
  CHECK(j.at("fixed_point").at("Q.y_dot").get<double>() == Approx(3.54285714).epsilon(1e-7));
  CHECK(j.at("multipliers").at(0).at(0).get<double>() == Approx(0.68661999).epsilon(1e-5));
  CHECK(std::abs(j.at("multipliers").at(0).at(1).get<double>()) == Approx(0.70605979).epsilon(1e-5));
  const Json half =
      costate_json({"cycle", scene, "--set", "cycle.period_s=0.7853981633974483", "--no-files"}, here.path(), 1);
  CHECK_THAT(half.at("error").get<std::string>(), Contains("no period of theirs"));
}
