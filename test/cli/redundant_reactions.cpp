// What a motion does not determine of its reactions is told wherever it is handed out.
#include <catch2/catch.hpp>

#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

TEST_CASE("reactions of redundant rows are told, and their sums that are determined are not") {
  // Three bars hold a point where two would do: their tensions are open, the force upwards is not, and below hangs a
  // pendulum whose bar's tension is known.
  const WorkingDirectory here;
  const std::string scene = COSTATE_SOURCE_DIR "/test/cases/hung_thrice.toml";
  const auto about = [&](const char* formulation, const std::string& output) {
    return costate_json({"gradient", scene, "--no-files", "--formulation", formulation, "--set",
                         "cost.running=[{kind=\"value\",output=\"" + output + "\"}]"},
                        here.path());
  };
  for (const char* formulation : {"maggi", "augmented-lagrangian", "penalty"}) {
    INFO(formulation);
    for (const char* known : {"pendulum.tension", "upwards"}) CHECK(about(formulation, known).at("warnings").empty());
    if (formulation == std::string("augmented-lagrangian")) continue;
    const std::string told = about(formulation, "b.tension").at("warnings").dump();
    CHECK_THAT(told, Contains("reactions that the motion does not determine"));
    CHECK_THAT(told, Contains("bar.a.length, bar.b.length, bar.c.length)"));
  }
  for (const char* command : {"simulate", "equilibrium"})
    CHECK_THAT(costate_json({command, scene, "--no-files"}, here.path()).at("warnings").dump(),
               Contains("does not determine the multipliers of rows that depend on each other (bar.a.length, "
                        "bar.b.length, bar.c.length)"));
  // What the text of a run without files does not show it does not warn of.
  CHECK(run_costate({"simulate", scene, "--no-files"}, here.path()).err.empty());
  const auto files = run_costate({"simulate", scene}, here.path());
  CHECK_THAT(files.err, Contains("nor what is made of them, a.tension, b.tension, c.tension: given are those that"));
}

// Of a parallelogram with three cranks the shares turn with it, and d(psi)/d(mc) = -0.613434 was -0.613793 +- 2e-7 by
// turns that differentiate another choice (maggi, and differences of augmented-lagrangian itself, have the former).
TEST_CASE("reactions of redundant rows: turns of the augmented Lagrangian have no gradient of their choice") {
  const WorkingDirectory here;
  const std::string scene = COSTATE_SOURCE_DIR "/test/cases/hung_thrice.toml",
                    cost = "cost.running=[{kind=\"value\",output=\"b.tension\"}]";
  for (const char* method : {"cvodes-forward", "cvodes-adjoint", "hand-tangent", "hand-adjoint", "discrete-adjoint"}) {
    INFO(method);
    const auto o = run_costate(
        {"gradient", scene, "--no-files", "--formulation", "augmented-lagrangian", "--method", method, "--set", cost},
        here.path());
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("it has no gradient of this psi. Take maggi") &&
                          Contains("bar.a.length, bar.b.length, bar.c.length)"));
  }
  const std::string told =
      costate_json({"simulate", scene, "--no-files", "--formulation", "augmented-lagrangian", "--set", cost},
                   here.path())
          .at("warnings")
          .dump();
  CHECK_THAT(told, Contains("reactions that the motion does not determine"));
}

TEST_CASE("reactions of contacts that close later and hold a body too often are told") {
  // A box that falls flat on two feet and slides to rest: from then on who bears how much of its friction is open.
  const WorkingDirectory here;
  std::string scene = R"toml([gravity]
y_m_per_s2 = -9.81
[body.b]
mass_kg = 2
inertia_kg_m2 = 0.1
x_m = 0
y_m = 0.25
vx_m_per_s = 0.2
[start]
given = ["b.x", "b.y", "b.angle"]
[run]
t_end_s = 1
outputs = ["b.x", "left.friction_force"]
)toml";
  for (const char* foot : {"left", "right"})
    scene += std::string("[point.") + foot + "]\non = \"b\"\nx_m = " + (*foot == 'l' ? "-0.3" : "0.3") +
             "\ny_m = -0.2\n[contact." + foot + "]\nkind = \"rigid\"\npoint = \"" + foot +
             "\"\nfriction = \"coulomb\"\nfriction_coefficient = 0.4\n";
  write_text(here.path() / "box.toml", scene);
  const Json told = costate_json({"simulate", "box.toml"}, here.path());
  CHECK_THAT(told.at("warnings").dump(),
             Contains("does not determine the multipliers of rows that depend on each other") &&
                 Contains("left.friction_force") && Contains("from t = 0."));
  // Before it lands nothing is open.
  const Json flying = costate_json({"simulate", "box.toml", "--no-files", "--t-end", "0.05"}, here.path());
  CHECK(flying.at("warnings").dump().find("does not determine") == std::string::npos);
}
