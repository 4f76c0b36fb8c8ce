// Cycles that begin where a rigid contact sticks: its place is one more unknown, or no cycle is told.
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "process.h"
#include "support/with_words.h"

using Catch::Contains;
using namespace costate::test;

namespace {

/// Where the mass B sticks.
const std::string kFloor = R"toml([gravity]
y_m_per_s2 = -10
[contact.floor]
kind = "rigid"
point = "B"
closed = true
sliding = "none"
friction = "coulomb"
friction_coefficient = 0.3
static_coefficient = 0.5
PLACE
)toml";

/// A mass that a spring with a moving end drags to and fro over the ground, from where it sticks.
const char* const kDragged = R"toml([point.B]
x_m = 0.12309798643135902
y_m = 0
[mass.B]
point = "B"
mass_kg = 2
[force.pull]
point = "B"
formula_x_N = "k*(A*cos(2*pi*t + PHASE) - B.x) - c*B.x_dot"
k = 200
A = 0.08
c = 1
[start]
given = [GIVEN]
given_velocities = [RATES]
[run]
t_end_s = 8
rtol = 1e-9
formulation = "index1"
parameters = ["A"]
[[cost.running]]
kind = "square"
output = "B.x"
[parameter.A]
number = "force.pull.A"
[cycle]
period_s = 1
)toml";

Outcome cycle_of(const std::vector<std::pair<std::string, std::string>>& with, const WorkingDirectory& here) {
  write_text(here / "dragged.toml", with_words(kFloor + kDragged, with));
  return run_costate({"cycle", "dragged.toml"}, here.path());
}

}  // namespace

// The same orbit from where it slides: period, cost, derivative and multiplier do not know where a cycle begins.
TEST_CASE("cycle places: where a contact sticks is an unknown") {
  const WorkingDirectory here;
  std::vector<nlohmann::json> found;
  for (const bool sticks : {true, false}) {
    const Outcome o =
        sticks ? cycle_of({{"PLACE", ""}, {"PHASE", "0.362539793"}, {"GIVEN", "\"B.x\""}, {"RATES", ""}}, here)
               : cycle_of({{"PLACE", ""},
                           {"PHASE", "-0.3"},
                           {"sliding = \"none\"", "sliding = \"forward\""},
                           {"x_m = 0.12309798643135902", "x_m = 0.114\nvx_m_per_s = 0.35"},
                           {"GIVEN", "\"B.x\""},
                           {"RATES", "\"B.x\""}},
                          here);
    INFO(o.err);
    REQUIRE(o.status == 0);
    found.push_back(nlohmann::json::parse(file_text(here / "results/dragged/cycle.json")));
  }
  CHECK(found[0]["fixed_point"]["B.x"].get<double>() == Approx(0.1230980).epsilon(1e-6));
  // Runs of rtol 1e-9 through six events: some hundred tolerances.
  const double same = 1e-6;
  CHECK(found[0]["psi"].get<double>() == Approx(found[1]["psi"].get<double>()).epsilon(same));
  CHECK(found[0]["multipliers"][0][0].get<double>() ==
        Approx(found[1]["multipliers"][0][0].get<double>()).epsilon(same));
}

TEST_CASE("cycle places: a number of the scene is none") {
  const WorkingDirectory here;
  // At the orbit's own place, where the motion comes back to it by chance, and elsewhere.
  for (const char* place : {"0.12309798643135902", "0.12"}) {
    const Outcome o = cycle_of(
        {{"PLACE", std::string("along_m = ") + place}, {"PHASE", "0.362539793"}, {"GIVEN", ""}, {"RATES", ""}}, here);
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("contact.floor.along_m") && Contains("so that the place is looked for"));
  }
}

// What sticks all the time comes back to where a number has it: nothing is looked for, and nothing is missing.
TEST_CASE("cycle places: what sticks all the time") {
  const WorkingDirectory here;
  const Outcome o = cycle_of(
      {{"PLACE", "along_m = 0.01"}, {"k = 200", "k = 20"}, {"PHASE", "0"}, {"GIVEN", ""}, {"RATES", ""}}, here);
  INFO(o.err);
  CHECK(o.status == 0);
  CHECK_THAT(o.out, Contains("psi over a cycle = 0.0001"));
}

// Dragged by a spring whose end moves at 0.1 m/s: it slides until it is as fast as that end, and sticks until the
// spring holds mu_s m g again.
TEST_CASE("cycle places: a section that is met where it sticks") {
  const char* const pulled = R"toml([point.B]
x_m = 0
y_m = 0
[mass.B]
point = "B"
mass_kg = 2
[point.P]
x_m = 0.02
y_m = 0
vx_m_per_s = 0.1
[mass.P]
point = "P"
mass_kg = 1
[force.P]
point = "P"
formula_x_N = "-3*(P.x_dot - 0.1)"
formula_y_N = "10 - 50*P.y - 10*P.y_dot"
[force.pull]
point = "B"
formula_x_N = "200*(P.x - B.x)"
[output.stretch]
formula = "P.x - B.x"
unit = "m"
[start]
given = [GIVEN"P.x", "P.y"]
given_velocities = ["P.x", "P.y"]
[run]
t_end_s = 3
rtol = 1e-9
formulation = "index1"
[cycle]
section = { output = "stretch", above = 0.03 }
travel = "P.x"
)toml";
  const WorkingDirectory here;
  write_text(here / "pulled.toml", with_words(kFloor + pulled, {{"PLACE", "along_m = 0"}, {"GIVEN", ""}}));
  const Outcome o = run_costate({"cycle", "pulled.toml", "--no-files"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("is not met where the search begins. contact.floor sticks there at its along_m"));
  write_text(here / "pulled.toml", with_words(kFloor + pulled, {{"PLACE", ""}, {"GIVEN", "\"B.x\", "}}));
  const Outcome placed = run_costate({"cycle", "pulled.toml"}, here.path());
  INFO(placed.err);
  REQUIRE(placed.status == 0);
  // With u = stretch - mu m g/k from u_0 = 0.02 m at rest, where the end's speed is V: u'' = -w^2 u, u_0' = V, until
  // u' = V again; then from -u_0 at V.
  const double w = 10, u = 0.02, V = 0.1, slides = 2 * (std::acos(-1.0) - std::atan(u * w / V)) / w;
  CHECK(nlohmann::json::parse(file_text(here / "results/pulled/cycle.json"))["period_s"].get<double>() ==
        Approx(slides + 2 * u / V).epsilon(1e-8));
}
