// What a command says of positions, periods, ends and minima that are none: contacts that no rest has, stiffnesses that
// follow the motion, a period of forces that are zero where one looks, an end that is hardly crossed, a column in
// another unit, a minimum beside a bound.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kPivot = R"toml([point.O]
ground = true
x_m = 0
y_m = 0
[point.pin]
on = "rod"
x_m = 0
y_m = 0
[revolute.pivot]
points = ["O", "pin"]
[start]
given = ["rod.angle"]
)toml";

std::string rod(double angle, double speed = 0) {
  return kPivot +
         "[body.rod]\nx_m = 0\ny_m = 0\nmass_kg = 1.5\ninertia_kg_m2 = 0.5\nangle_rad = " + std::to_string(angle) +
         "\nangular_velocity_rad_per_s = " + std::to_string(speed) + "\n";
}

Outcome run_scene(const std::string& text, std::vector<std::string> arguments) {
  const WorkingDirectory here;
  write_text(here / "scene.toml", text);
  arguments.insert(arguments.begin() + 1, {"scene.toml", "--no-files"});
  return run_costate(arguments, here.path());
}

}  // namespace

TEST_CASE("rests and ends: a balance that contacts do not allow is told") {
  const auto body = [](const std::string& more, const std::string& given) {
    return "[gravity]\ny_m_per_s2 = -9.81\n[body.b]\nx_m = 0\ny_m = 0.5\nmass_kg = 2\ninertia_kg_m2 = "
           "0.05\ncenter_y_m = -0.4\n[point.c]\non = \"b\"\nx_m = 0\ny_m = 0\n[contact.k]\nkind = \"rigid\"\npoint = "
           "\"c\"\nradius_m = 0.5\n" +
           more + "[start]\ngiven = [" + given + "]\n[run]\nt_end_s = 2\n";
  };
  // On a slope of 0.3 rad with friction for 0.2; at the bottom of a spring, beneath the ground.
  const std::string slope =
      body("friction = \"coulomb\"\nfriction_coefficient = 0.2\nground_angle_rad = 0.3\nclosed = true\nalong_m = 0\n",
           "\"b.angle\"");
  CHECK_THAT(run_scene(slope, {"equilibrium"}).err, Contains("'contact.k: slip' has happened already"));
  CHECK_THAT(run_scene(slope, {"modes", "--equilibrium"}).err, Contains("'contact.k: slip' has happened already"));
  // Enough of it: 0.4 > tan 0.3.
  const Outcome holds = run_scene(slope, {"equilibrium", "--set", "contact.k.friction_coefficient=0.4"});
  CHECK(holds.status == 0);
  CHECK(holds.err == "");
  const std::string sunk = body(
      "[point.top]\nground = true\nx_m = 0\ny_m = 2\n[spring.s]\nfrom = \"top\"\nto = "
      "\"c\"\nstiffness_N_per_m = 10\nnatural_length_m = 1\n",
      "\"b.x\", \"b.y\", \"b.angle\"");
  CHECK_THAT(run_scene(sunk, {"equilibrium", "--hold", "b.angle,b.x"}).err,
             Contains("'contact.k: touch' has happened already"));
}

TEST_CASE("rests and ends: a force that follows is judged by roots, not by a form") {
  // Ziegler's column of two rods of 1 m and 1 kg on springs of 1 N m/rad. Its stiffness [[2 - P, P - 1], [-1, 1]] has
  // the determinant 1 whatever P is: no root of M^-1 K is negative while they are real, as at P = 2.3.
  const std::string column = R"toml([point.O]
ground = true
x_m = 0
y_m = 0
[body.a]
x_m = 0
y_m = 0
mass_kg = 1
inertia_kg_m2 = 0.0833333
center_x_m = 0.5
[body.b]
x_m = 1
y_m = 0
mass_kg = 1
inertia_kg_m2 = 0.0833333
center_x_m = 0.5
[point.a0]
on = "a"
x_m = 0
y_m = 0
[point.a1]
on = "a"
x_m = 1
y_m = 0
[point.b0]
on = "b"
x_m = 0
y_m = 0
[point.b1]
on = "b"
x_m = 1
y_m = 0
[revolute.p]
points = ["O", "a0"]
[revolute.q]
points = ["a1", "b0"]
[torsion_spring.s1]
angle = "a"
stiffness_N_m_per_rad = 1
[torsion_spring.s2]
angles = ["a", "b"]
stiffness_N_m_per_rad = 1
[force.f]
point = "b1"
formula_x_N = "-P*cos(b.angle)"
formula_y_N = "-P*sin(b.angle)"
P = 2.3
[start]
given = ["a.angle", "b.angle"]
[run]
t_end_s = 1
)toml";
  const auto stable = [&](const std::vector<std::string>& sets) {
    std::vector<std::string> arguments = {"equilibrium", "--json"};
    for (const auto& set : sets) arguments.insert(arguments.end(), {"--set", set});
    const Outcome o = run_scene(column, arguments);
    INFO(o.err);
    REQUIRE(o.status == 0);
    return Json::parse(o.out).at("stable").get<bool>();
  };
  CHECK(stable({"force.f.P=2.3"}));
  // A load that keeps its direction buckles it: Euler.
  CHECK_FALSE(stable({"force.f.formula_x_N=\"-P\"", "force.f.formula_y_N=\"0*b.angle\""}));
}

TEST_CASE("rests and ends: a stiffness in time is no period of another force") {
  // At angle 0, where the search begins, the stiffness that changes with 5 rad/s is no force.
  const std::string scene = rod(0) +
                            "[couple.k]\nangle = \"rod\"\nformula = \"-k*(1+0.5*cos(w*t))*rod.angle - "
                            "0.2*rod.angle_dot + sin(2*pi*t)\"\nk = 3\nw = 5\n[run]\nt_end_s = 10\n[cycle]\n"
                            "period_s = 1\n";
  const Outcome o = run_scene(scene, {"cycle"});
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("this is no period of theirs"));
}

TEST_CASE("rests and ends: an end that is hardly crossed is told") {
  // cos t, which falls below -0.99999999 at 3.141451 s, and to 1e-8 of that level within a thousandth of a second.
  const std::string swing = rod(1) +
                            "[torsion_spring.s]\nangle = \"rod\"\nstiffness_N_m_per_rad = 0.5\n[run]\nt_end_s "
                            "= 7\n";
  const auto said = [&](const std::string& below) {
    const Outcome o =
        run_scene(swing, {"simulate", "--set", "run.ends_when={ output = \"rod.angle\", below = " + below + " }"});
    CHECK(o.status == 0);
    return o.err;
  };
  CHECK_THAT(said("-0.99999999"), Contains("The run's end is hardly crossed"));
  CHECK(said("-0.5") == "");
}

TEST_CASE("rests and ends: a column in degrees is not compared with an output in degrees") {
  const WorkingDirectory here;
  write_text(here / "m.csv", "t [s],angle [deg]\n0,50\n1,20\n2,-10\n");
  const std::string scene = rod(0.9) +
                            "[data.m]\nfile = \"m.csv\"\n[output.deg]\nformula = \"rod.angle*57.29578\"\nunit = "
                            "\"deg\"\n[[cost.samples]]\ndata = \"m\"\ncolumn = \"angle\"\noutput = "
                            "\"deg\"\nsigma = 1\n[run]\nt_end_s = 2\n";
  write_text(here / "scene.toml", scene);
  const Outcome o = run_costate({"simulate", "scene.toml", "--no-files"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("is read in rad"));
}

TEST_CASE("rests and ends: a fit beside a bound goes on to the minimum there") {
  // The shipped record, with a bound below the damping that it asks for: the minimum is that of a fit of the others
  // with the damping held there. It "converged" 0.98 above.
  const WorkingDirectory here;
  const std::string scene = COSTATE_MODELS_DIR "/identification/pendulum.toml";
  const auto fitted = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"fit", scene, "--no-files", "--json", "--max-iterations", "300"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome o = run_costate(arguments, here.path());
    INFO(o.err);
    REQUIRE(o.status == 0);
    return Json::parse(o.out);
  };
  const Json beside = fitted({"--set", "parameter.damping.upper=0.0185", "--set",
                              "torsion_spring.pivot.damping_N_m_s_per_rad=0.01"}),
             held = fitted(
                 {"--parameters", "length,released", "--set", "torsion_spring.pivot.damping_N_m_s_per_rad=0.0185"});
  const double least = held.at("chi_square").get<double>();
  CHECK(std::abs(beside.at("chi_square").get<double>() - least) < 1e-4 * least);
}

TEST_CASE("rests and ends: modes of coefficients that change say so, those of steady motions do not") {
  const auto remarks = [](const std::string& scene) {
    const WorkingDirectory here;
    write_text(here / "scene.toml", scene);
    return costate_json({"modes", "scene.toml"}, here.path()).at("warnings").dump();
  };
  const auto stiffness = [](const std::string& k) {
    return "[point.P]\nx_m = 1\ny_m = 0\n[mass.P]\npoint = \"P\"\nmass_kg = 1\n[gravity]\ny_m_per_s2 = 0\n"
           "[force.f]\npoint = \"P\"\nformula_x_N = \"-100*(1 + " +
           k + ")*(P.x - 1)\"\nformula_y_N = \"-50*P.y\"\n[start]\ngiven = [\"P.x\", \"P.y\"]\n[run]\nt_end_s = 1\n";
  };
  // At a turn of the stiffness, too.
  CHECK_THAT(remarks(stiffness("0.5*cos(12*t)")), Contains("change along the motion"));
  CHECK_THAT(remarks(stiffness("0.5*sin(12*t)")), Contains("change along the motion"));
  CHECK(remarks(stiffness("0.5")) == "[]");
  // Free spins about a principal axis: with it an axis of symmetry nothing changes as the body turns.
  const auto spin = [](const std::string& jxx) {
    return "[rigid_body.body]\nx_m = 0\ny_m = 0\nz_m = 0\nmass_kg = 1\ninertia_xx_kg_m2 = " + jxx +
           "\ninertia_yy_kg_m2 = 2\ninertia_zz_kg_m2 = 3\nomega_z_rad_per_s = 5\n[start]\ngiven = [\"body\"]\n"
           "[run]\nt_end_s = 1\n";
  };
  CHECK_THAT(remarks(spin("1")), Contains("change along the motion"));
  CHECK(remarks(spin("2")) == "[]");
  // Nor does anything of a car with a trailer; directions in which nothing may move are entries of rounding alone.
  const WorkingDirectory here;
  for (const char* v : {"1", "10", "25"}) {
    std::vector<std::string> arguments = {"modes", COSTATE_SOURCE_DIR "/test/cases/trailer_straight.toml"};
    for (const char* body : {"car", "tr", "up"})
      for (const std::string& a : {std::string("--set"), fmt::format("rigid_body.{}.vx_m_per_s={}", body, v)})
        arguments.push_back(a);
    CHECK(costate_json(arguments, here.path()).at("warnings").dump() == "[]");
  }
}

TEST_CASE("rests and ends: modes and derivatives at a kink of a force say so") {
  const WorkingDirectory here;
  const auto scene = [](const std::string& force, const std::string& start) {
    return "[point.P]\nx_m = 1\ny_m = 0\n[mass.P]\npoint = \"P\"\nmass_kg = 1\n[gravity]\ny_m_per_s2 = 0\n"
           "[force.f]\npoint = \"P\"\nformula_x_N = \"" +
           force + "\"\nformula_y_N = \"-50*P.y\"\n[start]\n" + start +
           "\n[parameter.m]\nnumber = \"mass.P.mass_kg\"\n[run]\nt_end_s = 1\nparameters = [\"m\"]\n";
  };
  const auto told = [&](const char* command, const std::string& force, const std::string& start,
                        std::vector<std::string> options = {}) {
    write_text(here / "scene.toml", scene(force, start));
    options.insert(options.begin(), {command, "scene.toml"});
    return costate_json(options, here.path()).at("warnings").dump();
  };
  const std::string given = "given = [\"P.x\", \"P.y\"]", balance = "equilibrium = true";
  // A spring of two stiffnesses, a damper of two branches: beside the kink nothing is said.
  CHECK_THAT(told("modes", "-60*(P.x - 1) - 40*max(0, P.x - 1)", given),
             Contains("the stiffness of P.x by P.x is") && Contains("60 on") && Contains("100 on"));
  CHECK_THAT(told("modes", "-60*(P.x - 1) - 2*P.x_dot - 3*max(0, P.x_dot)", given),
             Contains("the damping of P.x by P.x is") && Contains("2 on") && Contains("5 on"));
  // And not that anything changes along a motion that rests: rounding chose the branch.
  CHECK_THAT(told("modes", "0.7 - 60*(P.x - 1) - 2*P.x_dot - 3*max(0, P.x_dot)", balance),
             Contains("the damping of P.x by P.x is") && !Contains("change along"));
  CHECK(told("modes", "-60*(P.x - 1) - 40*max(0, P.x - 1.01)", given) == "[]");
  CHECK(told("modes", "-60*(P.x - 1)*(1 + abs(P.x - 1)^2) - 2*P.x_dot", given) == "[]");
  CHECK_THAT(told("equilibrium", "-60*(P.x - 1) - 40*max(0, P.x - 1)", balance, {"--derivatives"}),
             Contains("kink") && Contains("one side"));
  CHECK(told("equilibrium", "-60*(P.x - 1) - 40*max(0, P.x - 1)", balance) == "[]");
  CHECK(told("equilibrium", "1 - 60*(P.x - 1) - 40*max(0, P.x - 1)", balance, {"--derivatives"}) == "[]");
}
