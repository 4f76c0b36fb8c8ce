// costate explain: what it says was built is what the scene has; parts that nobody asked for; motions in space that
// stay in a plane.
#include <catch2/catch.hpp>
#include <cmath>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::kFiveBar;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

// Two pendulums that know nothing of each other; the cost asks for one.
const std::string kTwo = R"(title = "Two"

[gravity]
y_m_per_s2 = -9.81

[point.O]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[bar.asked]
from = "O"
to = "P"
mass_kg = 2

[point.R]
x_m = -0.6
y_m = -0.8

[bar.unasked]
from = "O"
to = "R"
mass_kg = 1

[start]
given = ["P.x", "R.x"]

[[cost.running]]
kind = "square"
output = "P.x"

[run]
t_end_s = 0.5
)";

const Json& kind(const Json& j, const std::string& name) {
  for (const Json& k : j.at("kinds"))
    if (k.at("kind") == name) return k;
  FAIL("no kind " << name);
  return j;
}

// A body in space, of Euler parameters or of base vectors, that flies with the start values `start`.
std::string flight_in_space(const std::string& start, bool natural = false) {
  return R"(
[gravity]
z_m_per_s2 = -9.81

[)" + std::string(natural ? "natural" : "rigid") +
         R"(_body.plate]
mass_kg = 1
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.2
inertia_zz_kg_m2 = 0.15
center_x_m = 0.5
)" + start +
         R"(
[start]
given = ["plate"]

[[cost.running]]
kind = "square"
output = "plate.z"

[run]
t_end_s = 0.5
)";
}

}  // namespace

TEST_CASE("explain: what was built and counted") {
  const WorkingDirectory here;
  const Json j = costate_json({"explain", kFiveBar, "--output", "out"}, here.path());
  CHECK(j.at("coordinates") == 6);
  CHECK(j.at("multipliers") == 4);
  CHECK(j.at("states") == 0);
  CHECK(j.at("degrees_of_freedom") == 2);
  CHECK(j.at("redundant").is_null());
  // index1 on IDAS: positions, velocities, accelerations, multipliers.
  CHECK(j.at("unknowns") == 6 + 6 + 6 + 4);
  const Json& square = j.at("patterns").at(0);
  CHECK(square.at("rows") == 6);
  CHECK(square.at("entries").get<long>() <= 36);
  // Each bar holds two ends (or one, where the other is the ground): 2 + 4 + 4 + 2 entries of Phi_q.
  CHECK(j.at("patterns").at(1).at("entries") == 12);
  // A run evaluates at least once a step, and its derivatives less often.
  const long dynamics = j.at("evaluations").at("dynamics").get<long>(),
             partials = j.at("evaluations").at("partials").get<long>();
  CHECK(dynamics >= j.at("counters").at("steps").get<long>());
  CHECK(partials > 0);
  CHECK(partials < dynamics);
  CHECK(kind(j, "spring").at("elements") == 2);
  const Json& bar = kind(j, "bar");
  CHECK(bar.at("elements") == 4);
  CHECK(bar.at("rows") == 4);
  CHECK(bar.at("constant_mass") == 4);
  double shares = 0;
  for (const Json& k : j.at("kinds")) {
    CHECK(k.at("share").get<double>() >= 0);
    shares += k.at("share").get<double>();
  }
  CHECK(shares > 0);
  CHECK(shares <= 1 + 1e-12);
  CHECK(j.at("parts").size() == 1);
  CHECK(j.at("parts").at(0).at("needed") == true);
  CHECK(j.at("plane").is_null());
  const auto text = run_costate({"explain", kFiveBar, "--no-files"}, here.path());
  CHECK(text.status == 0);
  CHECK_THAT(text.out, Contains("2 degrees of freedom") && Contains("Phi_q") && Contains("the rest") &&
                           Contains("4 of 4 bodies are constant"));
}

// A run passes over contacts while they are open: their kernels by themselves take longer.
TEST_CASE("explain: shares of contacts that are open for most of the run", "[explain]") {
  const WorkingDirectory here;
  const Json j = costate_json({"explain", COSTATE_MODELS_DIR "/bouncing_ball/bouncing_ball.toml", "--set",
                               "contact.floor.kind=rigid", "--no-files"},
                              here.path());
  double shares = 0;
  for (const Json& k : j.at("kinds")) shares += k.at("share").get<double>();
  CHECK(shares > 0);
  CHECK(shares <= 1 + 1e-12);
}

TEST_CASE("explain: parts that no output or cost needs") {
  const WorkingDirectory here;
  write_text(here / "two.toml", kTwo);
  Json j = costate_json({"explain", "two.toml", "--no-files"}, here.path());
  REQUIRE(j.at("parts").size() == 2);
  for (const Json& part : j.at("parts")) CHECK(part.at("needed") == (part.at("coordinates") == Json({"P.x", "P.y"})));
  CHECK_THAT(run_costate({"explain", "two.toml", "--no-files"}, here.path()).out,
             Contains("2 parts do not act on each other") && Contains("not needed") && Contains("bar.unasked"));
  // Who asks for the energy asks for all of it; who asks for the other's tension, for that.
  for (const char* output : {"energy.total", "unasked.tension"}) {
    j = costate_json({"explain", "two.toml", "--no-files", "--set", std::string("run.outputs=['") + output + "']"},
                     here.path());
    for (const Json& part : j.at("parts")) CHECK(part.at("needed") == true);
  }
}

TEST_CASE("explain: a motion in space that stays in a plane") {
  const WorkingDirectory here;
  // A body that falls and turns about y without a push sideways; and one that turns about a slanted axis while it
  // flies.
  write_text(here / "plane.toml",
             flight_in_space("x_m = 0\ny_m = 0\nz_m = 0\nvx_m_per_s = 1\nomega_y_rad_per_s = 2\n"));
  write_text(
      here / "space.toml",
      flight_in_space("x_m = 0\ny_m = 0\nz_m = 0\nvx_m_per_s = 1\nomega_x_rad_per_s = 1\nomega_y_rad_per_s = 2\n"));
  const Json plane = costate_json({"explain", "plane.toml", "--no-files"}, here.path()).at("plane");
  CHECK(plane.at("moves_in_plane") == true);
  CHECK(plane.at("normal").at(1).get<double>() == Approx(1));
  CHECK(plane.at("out_of_plane").get<double>() < 1e-6);
  const Json space = costate_json({"explain", "space.toml", "--no-files"}, here.path()).at("plane");
  CHECK(space.at("moves_in_plane") == false);
  CHECK(space.at("out_of_plane").get<double>() > 1e-3);
}

TEST_CASE("explain: bodies of base vectors turn out of the plane, too") {
  const WorkingDirectory here;
  // The origin's path is a parabola in the plane of x and z; the body itself tumbles, or turns about y alone.
  const std::string flight = "x_m = 0\ny_m = 0\nz_m = 0\nvx_m_per_s = 1\nomega_y_rad_per_s = 2\n";
  write_text(here / "plane.toml", flight_in_space(flight, true));
  write_text(here / "space.toml", flight_in_space(flight + "omega_x_rad_per_s = 1\n", true));
  const Json plane = costate_json({"explain", "plane.toml", "--no-files"}, here.path()).at("plane");
  CHECK(plane.at("moves_in_plane") == true);
  CHECK(plane.at("normal").at(1).get<double>() == Approx(1));
  CHECK(plane.at("line").is_null());
  CHECK(costate_json({"explain", "space.toml", "--no-files"}, here.path()).at("plane").at("moves_in_plane") == false);
}

TEST_CASE("explain: a motion along one line is in many planes") {
  const WorkingDirectory here;
  const auto fall = [](const std::string& name, const std::string& place) {
    return "[point." + name + "]\nx_m = 0\ny_m = " + place + "\nz_m = 0\n\n[mass." + name + "]\npoint = \"" + name +
           "\"\nmass_kg = 1\n\n";
  };
  write_text(here / "line.toml",
             "[gravity]\nz_m_per_s2 = -9.81\n\n" + fall("P", "0") + fall("R", "1") + "[run]\nt_end_s = 0.5\n");
  const Json plane = costate_json({"explain", "line.toml", "--no-files"}, here.path()).at("plane");
  CHECK(plane.at("line") == Json({0.0, 0.0, 1.0}));
  // Of all planes through the line the one in which the two points are.
  CHECK(plane.at("normal") == Json({1.0, 0.0, 0.0}));
  CHECK_THAT(run_costate({"explain", "line.toml", "--no-files"}, here.path()).out, Contains("moves along one line"));
}

TEST_CASE("explain: contacts that are never met are those whose gaps stay open, with events or without") {
  const WorkingDirectory here;
  const auto above = [](const std::string& name, const std::string& height, const std::string& law) {
    return "[point." + name + "]\nx_m = 0\ny_m = " + height + "\n\n[mass." + name + "]\npoint = \"" + name +
           "\"\nmass_kg = 1\n\n[contact.of_" + name + "]\npoint = \"" + name + "\"\nstiffness_N_per_m_n = 1e5\n" + law +
           "\n";
  };
  // Falls of 0.1 m last 0.14 s, those of 5 m 1 s. Hertz's law has no event; of the one that restores there is one, of
  // the other none.
  const std::string hertz = "law = \"hertz\"\n", latched = "law = \"hunt-crossley\"\nrestitution = 0.7\n";
  write_text(here / "fall.toml", "[gravity]\ny_m_per_s2 = -9.81\n\n" + above("A", "0.1", hertz) +
                                     above("B", "5", hertz) + above("C", "0.1", latched) + above("D", "5", latched) +
                                     "[run]\nt_end_s = 0.5\n");
  CHECK(costate_json({"explain", "fall.toml", "--no-files"}, here.path()).at("never_met") ==
        Json({"contact.of_B", "contact.of_D"}));
}
