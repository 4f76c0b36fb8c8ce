// costate tradeoff --levels: on motions known in closed form the errors that it states of a level are the true ones, a
// level that is exact is told from one that is not, and what it recommends is within what is asked for.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "process.h"
#include "support/markup.h"
#include "turning_mass.h"

using Catch::Matchers::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::foreign_references;
using costate::test::kTurning;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using costate::test::xml_fault;
using Json = nlohmann::json;

namespace {

constexpr double kEnd = 2, kFull = 3, kOff = 3.06;

double psi_of(double w) { return kEnd / 2 + std::sin(2 * w * kEnd) / (4 * w); }
double derivative_of(double w) {
  return kEnd * std::cos(2 * w * kEnd) / (2 * w) - std::sin(2 * w * kEnd) / (4 * w * w);
}

/// The largest difference of x = cos(w t) at the times that are compared, against the range there: 60 of them, each at
/// 0.381966 of its sixtieth.
double output_error() {
  double apart = 0, low = 1, high = -1;
  for (int i = 0; i < 60; ++i) {
    const double t = kEnd * (i + 0.381966) / 60, x = std::cos(kFull * t);
    apart = std::max(apart, std::abs(std::cos(kOff * t) - x));
    low = std::min(low, x);
    high = std::max(high, x);
  }
  return apart / (high - low);
}

const Json& level_of(const Json& j, const std::string& name) {
  for (const Json& l : j.at("levels"))
    if (l.at("name") == name) return l;
  throw std::runtime_error("no level " + name);
}

}  // namespace

TEST_CASE("tradeoff --levels: the errors that it states are the true ones") {
  const WorkingDirectory here;
  write_text(here / "full.toml", kTurning);
  std::string heavy = kTurning;  // a mass that the motion does not know
  heavy.replace(heavy.find("mass_kg = 2"), 11, "mass_kg = 7");
  write_text(here / "heavy.toml", heavy);
  const std::string change = "point.P.vy_m_per_s=3.06";
  const Json j = costate_json({"tradeoff", "full.toml", "--levels", "heavy.toml", "--level-set", change, "--gradient",
                               "--repeats", "1", "--output", "out"},
                              here.path());
  CHECK(j.at("status") == "ok");
  CHECK_THAT(j.at("notes").dump(), Contains("Parameter w is 3.06 in") && Contains("3 in the full model"));
  const auto stated = [&](const std::string& level, const char* measure) {
    return level_of(j, level).at("errors").at(measure);
  };
  const auto known_to = [&](const Json& error, const char* measure) {
    return j.at("reference_errors").at(measure).get<double>() +
           j.at("rows").at(error.at("row").get<std::size_t>()).at("integration_errors").at(measure).get<double>();
  };
  // w is both value and scale of its parameter.
  const double psi = std::abs(psi_of(kOff) / psi_of(kFull) - 1),
               gradient = std::abs(derivative_of(kOff) / derivative_of(kFull) - 1);
  for (const auto& [measure, truth] :
       {std::pair("psi", psi), std::pair("outputs", output_error()), std::pair("gradient", gradient)}) {
    INFO(measure << " " << truth);
    const Json off = stated(change, measure), exact = stated("heavy", measure);
    INFO(j.at("rows").at(off.at("row").get<std::size_t>()).dump());
    CHECK(off.at("resolved") == true);
    CHECK(std::abs(off.at("error").get<double>() - truth) <= known_to(off, measure));
    CHECK(known_to(off, measure) <= 0.3 * truth);
    CHECK(exact.at("resolved") == false);
    CHECK(exact.at("error").get<double>() < 1e-5);
    for (const Json& c : j.at("choices").at(measure)) {
      if (c.at("level") == change) CHECK(c.at("target").get<double>() >= truth);
      CHECK(j.at("rows").at(c.at("row").get<std::size_t>()).at("errors").at(measure).get<double>() <=
            c.at("target").get<double>());
    }
    CHECK(!j.at("choices").at(measure).empty());
  }
  // A level is taken no further than its own error needs, an exact one as far as the reference.
  const auto tightest = [&](const std::string& level) {
    double a = 1;
    for (const Json& r : j.at("rows"))
      if (r.at("level") == level) a = std::min(a, r.at("accuracy").get<double>());
    return a;
  };
  CHECK(tightest(change) >= 1e-4);
  CHECK(tightest("heavy") < 1e-4);

  CHECK(Json::parse(file_text(here / "out/tradeoff.json")) == j);
  std::istringstream csv(file_text(here / "out/tradeoff.csv"));
  std::string line;
  std::getline(csv, line);
  CHECK(line.rfind("level,coordinates,multipliers,accuracy,formulation,", 0) == 0);
  const auto columns = std::count(line.begin(), line.end(), ',');
  std::size_t lines = 0;
  for (; std::getline(csv, line); ++lines) CHECK(std::count(line.begin(), line.end(), ',') == columns);
  CHECK(lines == j.at("rows").size());
  const std::string page = file_text(here / "out/tradeoff.html");
  CHECK(xml_fault(page).empty());
  CHECK(foreign_references(page).empty());
  CHECK_THAT(page, Contains("Levels of detail: Turning") && Contains("heavy") && Contains("d(psi)/d w"));
}

TEST_CASE("tradeoff --levels: what a level lacks is told, and what cannot be compared refused") {
  const WorkingDirectory here;
  // An output of the full model alone.
  const std::string with =
      kTurning + "outputs = [\"P.x\", \"twice\"]\n\n[output.twice]\nformula = \"2*P.x\"\nunit = \"m\"\n";
  write_text(here / "full.toml", with);
  write_text(here / "plain.toml", kTurning);
  const Json j =
      costate_json({"tradeoff", "full.toml", "--levels", "plain.toml", "--repeats", "0", "--no-files"}, here.path());
  CHECK_THAT(j.at("notes").dump(), Contains("plain has no output twice."));
  CHECK(level_of(j, "plain").at("outputs") == Json({"P.x"}));
  CHECK(level_of(j, "plain").at("errors").at("gradient").is_null());
  CHECK(here.entries() == std::vector<std::string>{"full.toml", "plain.toml"});

  const auto message = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"tradeoff", "full.toml", "--levels", "plain.toml"});
    return costate_json(options, here.path(), 1).at("error").get<std::string>();
  };
  CHECK_THAT(message({"--outputs", "twice"}), Contains("no output 'twice' at level 'plain'"));
  CHECK_THAT(message({"--rtols", "1e-4"}), Contains("--rtols does not go with --levels"));
  CHECK_THAT(message({"--level-set", "run.t_end_s=3"}), Contains("over the same time") && Contains("0 .. 3 s"));
  CHECK_THAT(message({"--level-set", "run.ends_when={ output = \"P.y\", above = 0.5 }"}),
             Contains("ends by an event") && Contains("costate compare"));
  CHECK_THAT(message({"--level-set", "point.P.vz=1"}), Contains("vz"));
  CHECK_THAT(message({"--gradient", "--parameters", "output.twice.k"}), Contains("output.twice.k"));
}

TEST_CASE("tradeoff --levels: a budget ends it, and says what was left out") {
  const WorkingDirectory here;
  write_text(here / "full.toml", kTurning);
  const Json j = costate_json(
      {"tradeoff", "full.toml", "--level-set", "point.P.vy_m_per_s=3.06", "--budget", "1e-9", "--no-files"},
      here.path());
  REQUIRE(j.at("rows").size() == 2);
  for (const Json& r : j.at("rows")) {
    CHECK(r.at("status") == "left out");
    CHECK_THAT(r.at("why").get<std::string>(), Contains("budget"));
  }
  CHECK(level_of(j, "point.P.vy_m_per_s=3.06").at("errors").at("psi").is_null());
}
