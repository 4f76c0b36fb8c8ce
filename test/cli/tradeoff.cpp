// costate tradeoff: on motions known in closed form its stated errors are the true ones; its files, its JSON, what it
// refuses.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <sstream>

#include "five_bar.h"
#include "process.h"
#include "support/markup.h"
#include "turning_mass.h"

using Catch::Matchers::Contains;
using costate::test::all_between;
using costate::test::Connection;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::foreign_references;
using costate::test::kFiveBar;
using costate::test::kTurning;
using costate::test::Process;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using costate::test::xml_fault;
using Json = nlohmann::json;

namespace {

/// Of the turning mass (turning_mass.h):
/// psi = integral of x^2 over T = 2 s, T/2 + sin(2 w T) / (4 w), with its derivative by w.
constexpr double kRate = 3, kEnd = 2;
const double kPsi = kEnd / 2 + std::sin(2 * kRate * kEnd) / (4 * kRate);
const double kGradient =
    kEnd * std::cos(2 * kRate * kEnd) / (2 * kRate) - std::sin(2 * kRate * kEnd) / (4 * kRate * kRate);

const Json* row_of(const Json& j, const std::string& formulation, const std::string& integrator, double rtol,
                   const Json& method = nullptr) {
  for (const Json& r : j.at("rows"))
    if (r.at("formulation") == formulation && r.at("integrator") == integrator && r.at("method") == method &&
        (r.at("rtol").is_null() || r.at("rtol") == rtol))
      return &r;
  FAIL("no row " << formulation << " " << integrator << " " << rtol);
  return nullptr;
}

}  // namespace

TEST_CASE("tradeoff: the errors that it states are the true ones") {
  const WorkingDirectory here;
  write_text(here / "turning.toml", kTurning);
  const Json j =
      costate_json({"tradeoff", "turning.toml", "--gradient", "--formulations", "index1,baumgarte,maggi,penalty,index3",
                    "--methods", "idas-adjoint,cvodes-forward,hand-adjoint,discrete-adjoint", "--rtols",
                    "1e-4,1e-6,1e-8", "--steps", "0.02,0.01", "--repeats", "1", "--budget", "0"},
                   here.path());
  const Json& reference = j.at("reference");
  REQUIRE(reference.at("proven") == true);
  const Json &first = reference.at("first"), &second = reference.at("second");
  CHECK(first.at("formulation") != second.at("formulation"));
  CHECK(first.at("integrator") != second.at("integrator"));
  const double of_psi = reference.at("certified").at("psi").get<double>(),
               of_gradient = reference.at("certified").at("gradient").get<double>();
  // What it says of itself holds, and is worth something.
  CHECK(std::abs(j.at("psi").get<double>() - kPsi) <= of_psi * kPsi);
  CHECK(of_psi < 1e-8);
  // The start's speed has the scale 3.
  CHECK(std::abs(j.at("gradient").at("w").get<double>() - kGradient) <= of_gradient * std::abs(kGradient));
  CHECK(of_gradient < 1e-7);
  CHECK(reference.at("energy_kept") == true);
  int psis = 0, gradients = 0, fixed = 0;
  for (const Json& r : j.at("rows")) {
    if (r.at("status") != "ok") continue;
    INFO(r.dump());
    const double truth = std::abs(r.at("psi").get<double>() - kPsi) / kPsi;
    CHECK(std::abs(r.at("errors").at("psi").get<double>() - truth) <= of_psi);
    CHECK(r.at("below_certified").at("psi") == (r.at("errors").at("psi").get<double>() <= of_psi));
    ++psis;
    gradients += !r.at("method").is_null();
    fixed += r.at("integrator") == "fixed";
    CHECK(r.at("method").is_null() == r.at("errors").at("gradient").is_null());
    CHECK(r.at("method").is_null() != r.at("errors").at("outputs").is_null());
  }
  CHECK(psis > 30);
  CHECK(gradients > 15);
  CHECK(fixed >= 4);
  // Along the motion: that of index1 on IDAS drifts, the others hold the bar; the coordinates of maggi do so to
  // rounding.
  const Json& maggi = *row_of(j, "maggi", "cvodes", 1e-4);
  CHECK(maggi.at("drift").at("position").get<double>() < 1e-12);
  const Json& drifting = *row_of(j, "index1", "idas", 1e-4);
  CHECK(drifting.at("drift").at("position").get<double>() > 1e-9);
  // A drift of Phi in the length is an error of the coordinates, whose range is 2 m.
  CHECK(drifting.at("errors").at("outputs").get<double>() > 0);
}

TEST_CASE("tradeoff: its files say the same, and the keys stay") {
  const WorkingDirectory here;
  write_text(here / "turning.toml", kTurning);
  const Json j = costate_json({"tradeoff", "turning.toml", "--rtols", "1e-3,1e-4,1e-5,1e-6", "--repeats", "3",
                               "--output", "out", "--formulations", "index1,baumgarte,index2,penalty"},
                              here.path());
  CHECK(j.at("status") == "ok");
  for (const char* key : {"psi", "parameters", "reference", "rows", "fronts", "choices", "out_of_line", "refusals",
                          "warnings", "settings", "wall_s"})
    CHECK(j.contains(key));
  CHECK(j.at("gradient").is_null());
  const Json& rows = j.at("rows");
  for (const Json& r : rows) {
    INFO(r.dump());
    REQUIRE(r.at("status") == "ok");
    for (const char* key :
         {"formulation", "integrator", "method", "rtol", "step_s", "psi", "errors", "below_certified", "worst", "drift",
          "steps", "callbacks", "factorizations", "counters", "time_s", "repeats", "warnings"})
      CHECK(r.contains(key));
    CHECK(r.at("repeats") == 3);
    CHECK(r.at("time_s").get<double>() > 0);
    CHECK(r.at("rtol").is_null() != r.at("step_s").is_null());
    CHECK(r.at("callbacks").get<long>() > r.at("steps").get<long>());
  }
  for (const char* measure : {"psi", "outputs"}) {
    const Json& front = j.at("fronts").at(measure);
    REQUIRE(!front.empty());
    double time = 0;
    for (const Json& i : front) {
      CHECK(rows.at(i.get<std::size_t>()).at("time_s").get<double>() >= time);
      time = rows.at(i.get<std::size_t>()).at("time_s").get<double>();
    }
    for (const Json& c : j.at("choices").at(measure)) {
      CHECK(c.at("error").get<double>() <= c.at("target").get<double>());
      CHECK_THAT(c.at("text").get<std::string>(), Contains(std::string(measure)) && Contains(" ms"));
    }
  }
  // What is not possible is said, with the cause.
  CHECK_THAT(j.at("refusals").dump(), Contains("index2") && Contains("has no explicit form"));
  CHECK(Json::parse(file_text(here / "out/tradeoff.json")) == j);
  std::istringstream csv(file_text(here / "out/tradeoff.csv"));
  std::string line;
  std::getline(csv, line);
  CHECK(line.rfind("formulation,integrator,method,rtol,step_s,status,psi,", 0) == 0);
  const auto columns = std::count(line.begin(), line.end(), ',');
  std::size_t lines = 0;
  for (; std::getline(csv, line); ++lines) CHECK(std::count(line.begin(), line.end(), ',') == columns);
  CHECK(lines == rows.size());
  const std::string page = file_text(here / "out/tradeoff.html");
  CHECK(xml_fault(page).empty());
  CHECK(foreign_references(page).empty());
  CHECK(all_between(page, "<svg ", "</svg>").size() == 4);  // time and callbacks over both errors
  CHECK_THAT(page, Contains("Accuracy against cost: Turning") && Contains("They share neither formulation nor") &&
                       Contains("index2 on cvodes") && Contains("Pareto front") && Contains("next digit"));
}

TEST_CASE("tradeoff: rows that depend on each other") {
  const WorkingDirectory here;
  std::string twice = kTurning;
  twice.insert(twice.find("[start]"), "[distance.again]\nfrom = \"O\"\nto = \"P\"\n\n");
  write_text(here / "twice.toml", twice);
  const Json j =
      costate_json({"tradeoff", "twice.toml", "--rtols", "1e-4,1e-6", "--repeats", "0", "--no-files"}, here.path());
  CHECK(j.at("reference").at("proven") == true);
  std::string refused;
  for (const Json& x : j.at("refusals"))
    if (x.at("formulation") == "index1" && x.at("integrator") == "idas") refused = x.at("why").get<std::string>();
  CHECK_THAT(refused, Contains("1 of 2 constraint rows depend on the others") && Contains("independent rows"));
  for (const Json& r : j.at("rows")) {
    CHECK(r.at("formulation") != "index1");
    CHECK(r.at("formulation") != "baumgarte");
  }
  CHECK(here.entries() == std::vector<std::string>{"twice.toml"});
}

TEST_CASE("tradeoff: a budget ends it, and says what was left out") {
  const WorkingDirectory here;
  const Json j =
      costate_json({"tradeoff", kFiveBar, "--budget", "0.3", "--no-files", "--set", "run.t_end_s=40"}, here.path());
  CHECK(j.at("status") == "ok");
  std::size_t left_out = 0;
  for (const Json& r : j.at("rows"))
    if (r.at("status") == "left out" || r.at("status") == "cut") {
      ++left_out;
      CHECK(!r.at("why").get<std::string>().empty());
    }
  CHECK(left_out > 0);
}

TEST_CASE("tradeoff: Ctrl-C keeps what is there") {
  const WorkingDirectory here;
  write_text(here / "turning.toml", kTurning);
  Process p(COSTATE_EXECUTABLE, {"tradeoff", "turning.toml", "--output", "out", "--budget", "0", "--repeats", "1000"},
            here.path(), Connection::terminal_errors);
  REQUIRE(p.wait_until([&] { return p.seen().find("for the clock") != std::string::npos; }));
  p.send(SIGINT);
  CHECK(p.finish().status == 128 + SIGINT);
  const Json j = Json::parse(file_text(here / "out/tradeoff.json"));
  CHECK(j.at("status") == "interrupted");
  CHECK_THAT(j.at("error").get<std::string>(), Contains("What had been measured until then stands."));
  CHECK(j.at("rows").size() > 50);
  CHECK(!j.at("choices").at("psi").empty());
  CHECK(xml_fault(file_text(here / "out/tradeoff.html")).empty());
}

TEST_CASE("tradeoff: mistakes name the option") {
  const WorkingDirectory here;
  write_text(here / "turning.toml", kTurning);
  const auto message = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"tradeoff", "turning.toml"});
    return costate_json(options, here.path(), 1).at("error").get<std::string>();
  };
  CHECK_THAT(message({"--rtols", "1e-3,x"}), Contains("--rtols") && Contains("'x'"));
  CHECK_THAT(message({"--rtols", "2"}), Contains("between 0 and 1") && Contains("'2'"));
  CHECK_THAT(message({"--steps", "-1"}), Contains("--steps") && Contains("'-1'"));
  CHECK_THAT(message({"--budget", "-3"}), Contains("--budget"));
  CHECK_THAT(message({"--repeats", "-1"}), Contains("--repeats"));
  CHECK_THAT(message({"--samples", "1"}), Contains("--samples"));
  CHECK_THAT(message({"--patience", "0"}), Contains("--patience"));
  CHECK_THAT(message({"--outputs", "Q.x"}), Contains("--outputs") && Contains("Q.x"));
  CHECK_THAT(message({"--formulations", "index9"}), Contains("--formulations") && Contains("index9"));
  CHECK_THAT(message({"--integrators", "rk4"}), Contains("--integrators") && Contains("rk4"));
  CHECK_THAT(message({"--methods", "idas-adjoint"}), Contains("--gradient"));
  CHECK_THAT(message({"--gradient", "--methods", "magic"}), Contains("--methods") && Contains("magic"));
  CHECK_THAT(message({"--formulations", "index2", "--integrators", "cvodes"}), Contains("has no explicit form"));
  CHECK(here.entries() == std::vector<std::string>{"turning.toml"});
}
