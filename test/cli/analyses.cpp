// costate equilibrium, modes and sweep: what they print, write and say.
#include <catch2/catch.hpp>
#include <cmath>

#include "five_bar.h"
#include "process.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::vector<std::string> kAtRest = {"--set", "spring.S1.natural_length_m=" + std::to_string(kOptimalL01), "--set",
                                          "spring.S2.natural_length_m=" + std::to_string(kOptimalL02)};

std::vector<std::string> with(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

TEST_CASE("costate equilibrium: the five-bar whose springs hold it where it starts") {
  const WorkingDirectory here;
  const Json j = costate_json(with({"equilibrium", kFiveBar}, kAtRest), here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("stable") == true);
  CHECK(j.at("degrees_of_freedom") == 2);
  // std::to_string leaves six decimals.
  CHECK(j.at("positions").at("P2.x").get<double>() == Approx(0.5).margin(1e-5));
  CHECK(j.at("positions").at("P2.y").get<double>() == Approx(-2).margin(1e-5));
  CHECK(j.at("residual").get<double>() < 1e-10);
  CHECK(j.at("outputs").contains("S1.force"));
  CHECK(j.at("multipliers").contains("bar.A1.length"));
  CHECK(here.entries().empty());
}

TEST_CASE("costate equilibrium: a run that starts there stays there") {
  const WorkingDirectory here;
  const Json rest = costate_json({"equilibrium", kFiveBar}, here.path());
  const Json run = costate_json({"simulate", kFiveBar, "--no-files", "--set", "start.equilibrium=true", "--set",
                                 "start.given=[]", "--rtol", "1e-9"},
                                here.path());
  for (const auto& [name, x] : rest.at("positions").items()) {
    INFO(name);
    CHECK(run.at("terminal").at(name).get<double>() == Approx(x.get<double>()).epsilon(1e-7));
  }
  // psi = T |r2 - r2(0)|^2, and its gradient is that of the equilibrium.
  const double x = rest.at("positions").at("P2.x").get<double>() - 0.5,
               y = rest.at("positions").at("P2.y").get<double>() + 2;
  CHECK(run.at("psi").get<double>() == Approx(5 * (x * x + y * y)).epsilon(1e-7));
  const Json gradient = costate_json({"gradient", kFiveBar, "--no-files", "--set", "start.equilibrium=true", "--set",
                                      "start.given=[]", "--rtol", "1e-9"},
                                     here.path());
  const Json derivatives =
      costate_json({"equilibrium", kFiveBar, "--derivatives", "--outputs", "P2.x,P2.y"}, here.path());
  for (const auto& [name, g] : gradient.at("gradient").items()) {
    INFO(name);
    const Json& d = derivatives.at("derivatives");
    const double expected = 10 * (x * d.at("P2.x").at(name).get<double>() + y * d.at("P2.y").at(name).get<double>());
    CHECK(g.get<double>() == Approx(expected).epsilon(1e-6));
  }
}

TEST_CASE("costate equilibrium: held positions, files and mistakes") {
  const WorkingDirectory here;
  const Json j = costate_json({"equilibrium", kFiveBar, "--hold", "P1.x,P3.x", "--output", "rest.json"}, here.path());
  CHECK(j.at("degrees_of_freedom") == 0);
  CHECK(j.at("positions").at("P1.x") == -1);
  CHECK(j.at("held").size() == 2);
  CHECK(one_object(file_text(here / "rest.json")) == j);
  const Outcome text = run_costate({"equilibrium", kFiveBar}, here.path());
  CHECK(text.status == 0);
  CHECK_THAT(text.out, Contains("2 coordinates found by balance") && Contains("P2.y") && Contains("S2.force"));
  const Outcome wrong = run_costate({"equilibrium", kFiveBar, "--hold", "P1.z"}, here.path());
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, Contains("no coordinate 'P1.z'") && Contains("Did you mean"));
  const Outcome loose = run_costate(
      {"equilibrium", kFiveBar, "--set", "spring.S1.stiffness_N_per_m=0", "--set", "spring.S2.stiffness_N_per_m=0",
       "--set", "gravity.y_m_per_s2=0", "--set", "parameter.k1.lower=0", "--set", "parameter.k2.lower=0"},
      here.path());
  CHECK(loose.status == 1);
  CHECK_THAT(loose.err, Contains("five_bar.toml:") && Contains("nothing holds"));
}

TEST_CASE("costate modes: frequencies, shapes and files") {
  const WorkingDirectory here;
  const Json j = costate_json({"modes", kFiveBar, "--equilibrium", "--shapes", "shapes.csv"}, here.path());
  REQUIRE(j.at("modes").size() == 2);
  CHECK(j.at("zero_eigenvalues") == 0);
  CHECK(j.at("largest_acceleration").get<double>() < 1e-10);
  // A small motion about the equilibrium has these frequencies: the run's period, by the zero of a velocity.
  const double f = j.at("modes").at(0).at("frequency_Hz");
  CHECK(f > 0.1);
  CHECK(f < j.at("modes").at(1).at("frequency_Hz").get<double>());
  const std::string csv = file_text(here / "shapes.csv");
  CHECK(csv.rfind("mode,frequency_Hz,damping_ratio,real_per_s,imaginary_per_s,P1.x.re,P1.x.im", 0) == 0);
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 3);
  // About the start as it is the five-bar is on the move.
  const Outcome start = run_costate({"modes", kFiveBar}, here.path());
  CHECK(start.status == 0);
  CHECK_THAT(start.out, Contains("not steady"));
  // Programs that read the JSON are told as well.
  CHECK(j.at("warnings").empty());
  const Json moving = costate_json({"modes", kFiveBar}, here.path());
  CHECK_THAT(moving.at("warnings").dump(), Contains("This start is not steady, as P"));
}

TEST_CASE("costate sweep: a table to where the mechanism locks") {
  const WorkingDirectory here;
  const Json j = costate_json({"sweep", kFiveBar, "--coordinate", "P1.x", "--from", "-0.9", "--to", "-0.5", "--count",
                               "5", "--hold", "P3.x", "--outputs", "P1.y,S1.force", "--output", "out"},
                              here.path());
  CHECK(j.at("status") == "ok");
  REQUIRE(j.at("values").size() == 5);
  // A1 is as long as the root of two.
  for (std::size_t k = 0; k < 5; ++k) {
    const double x = j.at("values").at(k), y = j.at("outputs").at("P1.y").at(k);
    CHECK(x == Approx(-0.9 + 0.1 * static_cast<double>(k)));
    CHECK(x * x + y * y == Approx(2).epsilon(1e-12));
  }
  CHECK(here.entries() == std::vector<std::string>{"out", "out/sweep.csv", "out/sweep.html", "out/sweep.json"});
  CHECK_THAT(file_text(here / "out/sweep.csv"), Contains("P1.x [m],P1.y [m],S1.force [N],held_force"));
  const Json locked = costate_json({"sweep", kFiveBar, "--coordinate", "P1.x", "--from", "-1", "--to", "-1.6",
                                    "--count", "7", "--hold", "none", "--no-files"},
                                   here.path(), 1);
  CHECK(locked.at("status") == "stopped");
  CHECK(locked.at("values").size() == 5);
  CHECK(locked.at("reached").get<double>() == Approx(-std::sqrt(2)).epsilon(1e-3));
  const Outcome many =
      run_costate({"sweep", kFiveBar, "--coordinate", "P1.x", "--from", "0", "--to", "1"}, here.path());
  CHECK_THAT(many.err, Contains("Too many given positions") && Contains("--hold"));
  const Outcome wrong =
      run_costate({"sweep", kFiveBar, "--coordinate", "P9.x", "--from", "0", "--to", "1"}, here.path());
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, Contains("no coordinate 'P9.x'"));
  CHECK(run_costate({"sweep", kFiveBar, "--coordinate", "P1.x", "--from", "0"}, here.path()).status == 2);
}

TEST_CASE("costate sweep: a balance that is not stable is told where it begins") {
  // A post of 1 m, held by 10 N/m from the sides, that a spring of 40 N/m pulls down from L - 1 m below its foot: it
  // stands upright as long as 40 (L - 1)^2 < 10 L, up to L = 1.6404 m.
  const WorkingDirectory here;
  const std::vector<std::string> sweep = {"sweep",        COSTATE_SOURCE_DIR "/test/cases/pulled_post.toml",
                                          "--coordinate", "A.y",
                                          "--hold",       "A.x",
                                          "--count",      "10",
                                          "--no-files",   "--from",
                                          "-0.1",         "--to"};
  auto down = sweep, not_far = sweep;
  down.emplace_back("-1");
  not_far.emplace_back("-0.64");
  const Json j = costate_json(down, here.path());
  CHECK(j.at("stable") == Json({true, true, true, true, true, true, false, false, false, false}));
  CHECK_THAT(j.at("warnings").dump(), Contains("At 4 of 10 points, first at A.y = -0.7 m, the balance is not stable"));
  CHECK_THAT(costate_json(not_far, here.path()).at("warnings").dump(), !Contains("not stable"));
}

// Weights, reactions and the norm's multiplier cancel in the stiffness of the spin, and left "modes" of 1e-8 Hz, or one
// that grows, without a word of rounding.
TEST_CASE("costate modes: a spin that is free beside a pendulum's weight is two zeros") {
  const WorkingDirectory here;
  for (const char* g : {"-9.81", "-1"})
    for (const char* mass : {"2", "5.3", "0.7"}) {
      CAPTURE(g, mass);
      write_text(here / "s.toml", std::string("[gravity]\nz_m_per_s2 = ") + g +
                                      "\n[point.O]\nground = true\nx_m = 0\ny_m = 0\nz_m = 0\n[rigid_body.R]\nx_m = "
                                      "0\ny_m = 0\nz_m = -1\nmass_kg = " +
                                      mass +
                                      "\ninertia_xx_kg_m2 = 0.3\ninertia_yy_kg_m2 = 0.3\ninertia_zz_kg_m2 = "
                                      "0.1\n[point.top]\non = \"R\"\nx_m = 0\ny_m = 0\nz_m = 1\n[spherical.J]\npoints "
                                      "= [\"O\", \"top\"]\n[start]\ngiven = [\"R.orientation\"]\n[run]\nt_end_s = 1\n");
      const Json j = costate_json({"modes", "s.toml", "--no-files"}, here.path());
      CHECK(j.at("zero_eigenvalues") == 2);
      REQUIRE(j.at("modes").size() == 2);
      const double m = std::stod(mass), w = std::sqrt(-m * std::stod(g) / (m + 0.3));
      for (const Json& mode : j.at("modes"))
        CHECK(mode.at("frequency_Hz").get<double>() == Approx(w / (2 * M_PI)).epsilon(1e-9));
    }
}
