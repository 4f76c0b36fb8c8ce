// Cycles whose section is the touch of a rigid contact: the run ends as something strikes, as it is meant to.
#include <catch2/catch.hpp>

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
