// What is printed is known: no more digits than the tolerance can hold or an estimate of the error leaves; JSON keeps
// all. And every number stored has its unit.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <regex>

#include "five_bar.h"
#include "process.h"
#include "support/paths.h"

using Catch::Contains;
using costate::test::costate_json;
using costate::test::file_text;
using costate::test::kFiveBar;
using costate::test::one_object;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

const std::string kEngine = COSTATE_SOURCE_DIR "/test/cases/engine_friction.toml";
// By Baumgarte and Maggi at rtol 1e-12, which agree in these digits.
constexpr double kEnginePsi = 5113.706845, kEngineByInertia = -179470.37;

std::string text_of(std::vector<std::string> arguments, const WorkingDirectory& here) {
  arguments.push_back("--no-files");
  const auto outcome = run_costate(arguments, here.path());
  REQUIRE(outcome.status == 0);
  return outcome.out;
}

/// The number behind `label`, as it is printed.
std::string printed(const std::string& text, const std::string& label) {
  std::smatch found;
  REQUIRE(std::regex_search(text, found, std::regex(label + R"(\s+(-?[0-9.]+(e[-+]?[0-9]+)?))")));
  return found[1];
}

int significant_digits(const std::string& number) {
  int digits = 0;
  for (const char c : number.substr(0, number.find('e')))
    if (std::isdigit(static_cast<unsigned char>(c)) && (digits > 0 || c != '0')) ++digits;
  return digits;
}

}  // namespace

TEST_CASE("digits: as many as the tolerance can hold, and the text says so") {
  const WorkingDirectory here;
  for (const auto& [rtol, digits] : {std::pair("1e-6", 6), std::pair("1e-8", 8), std::pair("1e-11", 11)}) {
    INFO(rtol);
    for (const std::string command : {"simulate", "gradient"}) {
      // Once: a run that is confirmed knows more of its error.
      std::vector<std::string> words{command, kFiveBar, "--rtol", rtol, "--no-confirm"};
      const std::string text = text_of(words, here);
      CHECK(significant_digits(printed(text, "psi =")) == digits);
      CHECK_THAT(text, Contains("no more digits than") && Contains("--estimate-error"));
    }
    // The largest scaled component of the gradient has that many, the others end at the same place.
    const std::string text = text_of({"gradient", kFiveBar, "--rtol", rtol, "--no-confirm"}, here);
    CHECK(significant_digits(printed(text, R"(L01\s+2\.2[0-9]+)")) <= digits);
  }
  CHECK(costate_json({"simulate", kFiveBar, "--no-files", "--no-confirm"}, here.path()).at("psi_error").is_null());
  // A tenth of what a run at a hundred times the tolerance is off by: no promise, and of the right size.
  const Json j = costate_json({"simulate", kFiveBar, "--no-files"}, here.path());
  CHECK(std::abs(j.at("psi").get<double>() - costate::test::kPsi) < 10 * j.at("psi_error").get<double>());
  CHECK(j.at("psi_error") < 1e-6);
}

TEST_CASE("digits: an engine with friction, whose steps' errors add up a thousandfold, says what is known when asked") {
  const WorkingDirectory here;
  const Json simulated = costate_json({"simulate", kEngine, "--estimate-error", "--no-files"}, here.path());
  const Json derived = costate_json({"gradient", kEngine, "--estimate-error", "--no-files"}, here.path());
  const auto covered = [](double error, double estimate) {
    // A rerun at a tenth of the tolerance leaves some tenth of the error, if these were smooth. Neighbouring tolerances
    // scatter by a factor of four either way; an error may be small by chance, an estimate that is must not.
    CHECK(estimate >= error / 4);
    CHECK(estimate <= 16 * error);
  };
  covered(std::abs(simulated.at("psi").get<double>() - kEnginePsi), simulated.at("psi_error").get<double>());
  covered(std::abs(derived.at("psi").get<double>() - kEnginePsi), derived.at("psi_error").get<double>());
  covered(std::abs(derived.at("gradient").at("J").get<double>() - kEngineByInertia),
          derived.at("gradient_error").at("J").get<double>());
  // What is printed is right to one unit of the last digit.
  const std::string text = text_of({"simulate", kEngine, "--estimate-error"}, here);
  CHECK_THAT(text, Contains("(estimated error "));
  CHECK(significant_digits(printed(text, "psi =")) <= 7);
}

// By baumgarte the run printed -179383.00 where -179470.37 is right; it had compared itself with others and warned.
TEST_CASE("digits: what a run finds out about its error, or warns of, ends the digits that it prints") {
  const WorkingDirectory here;
  const auto look = [&](std::vector<std::string> words, const std::string& label, const std::string& parameter,
                        double right, double psi) {
    CAPTURE(words);
    const std::string text = text_of(words, here);
    words.insert(words.end(), {"--json", "--no-files"});
    const Json j = one_object(run_costate(words, here.path()).out);
    const double error = j.at("gradient_error").at(parameter).get<double>(),
                 off = std::abs(j.at("gradient").at(parameter).get<double>() - right);
    CAPTURE(text, error, off);
    // As for estimates that are asked for.
    CHECK(error >= off / 4);
    CHECK(std::abs(j.at("psi").get<double>() - psi) <= 4 * j.at("psi_error").get<double>());
    // No digit below the error's first one is printed, and those that are printed are right to that.
    const std::string number = printed(text, label);
    CHECK(std::abs(std::stod(number) - right) <= 5 * error);
    const int first = static_cast<int>(std::floor(std::log10(std::abs(right)))),
              last = static_cast<int>(std::floor(std::log10(error)));
    CHECK(significant_digits(number) <= first - last + 1);
    CHECK_THAT(text, Contains("estimated error"));
  };
  for (const char* formulation : {"baumgarte", "index1", "index2"})
    look({"gradient", kEngine, "--formulation", formulation}, R"(J\s+0\.05)", "J", kEngineByInertia, kEnginePsi);
  // A run that is confirmed by another one at rtol 1e-6, of a well-behaved motion: six digits or seven.
  look({"gradient", kFiveBar}, R"(L02\s+2\.06155281281)", "L02", costate::test::kGradient.at("L02"),
       costate::test::kPsi);
  // Rows that drift by 1e-4 of their length in 300 s by index 1, of a motion whose psi has no more digits than that.
  const std::string drifting = COSTATE_SOURCE_DIR "/test/cases/longp.toml";
  const std::vector<std::string> words{"simulate", drifting, "--formulation", "index1", "--set", "run.t_end_s=300"};
  CHECK(significant_digits(printed(text_of(words, here), "psi =")) <= 5);
  // A motion at a loose tolerance that another one does not confirm.
  const std::vector<std::string> loose{"simulate", COSTATE_MODELS_DIR "/rigid_body/dzhanibekov.toml", "--rtol", "1e-4"};
  CHECK_THAT(text_of(loose, here), Contains("estimated error"));
  CHECK(significant_digits(printed(text_of(loose, here), "psi =")) <= 2);
}

TEST_CASE("digits: fixed steps print the step, and what psi is then") {
  const WorkingDirectory here;
  const std::vector<std::string> run = {"simulate", kFiveBar, "--formulation", "index3", "--integrator", "fixed"};
  const std::string chosen = text_of(run, here);
  CHECK_THAT(chosen, Contains("steps of ") && Contains("the step is chosen for an error of about 1e-05 of psi") &&
                         !Contains("rtol"));
  CHECK(significant_digits(printed(chosen, "psi =")) == 5);
  auto given = run;
  given.insert(given.end(), {"--step", "0.005"});
  const std::string text = text_of(given, here);
  CHECK_THAT(text, Contains("1000 steps of 0.005 s") && Contains("of these steps, exactly"));
  given.push_back("--estimate-error");
  given.push_back("--no-files");
  const Json j = costate_json(given, here.path());
  const double error = std::abs(j.at("psi").get<double>() - costate::test::kPsi);
  CHECK(j.at("psi_error").get<double>() == Approx(error).epsilon(0.1));  // of second order, and the steps are small
}

TEST_CASE("units: every value that simulate ends with has its unit, multipliers too") {
  const WorkingDirectory here;
  const Json five_bar = costate_json({"simulate", kFiveBar, "--no-files"}, here.path());
  REQUIRE(five_bar.at("units").size() == five_bar.at("terminal").size());
  CHECK(five_bar.at("units").at("lambda.bar.A1.length") == "N/m");
  CHECK(five_bar.at("units").at("P2.x_ddot") == "m/s^2");
  const Json iltis = costate_json(
      {"simulate", COSTATE_MODELS_DIR "/iltis/steer_ramp_20.toml", "--t-end", "0.001", "--no-files"}, here.path());
  for (const auto& [name, unit] : iltis.at("units").items()) {
    INFO(name);
    CHECK(unit != "");
    if (!name.starts_with("lambda.")) continue;
    const auto ends = [&name](const char* with) { return name.ends_with(with); };
    if (ends(".x") || ends(".y") || ends(".z")) CHECK(unit == "N");
    if (ends(".tilt_1") || ends(".tilt_2") || ends(".norm") || ends(".angle")) CHECK(unit == "N m");
    if (ends(".length")) CHECK(unit == "N/m");
    CHECK(unit.get<std::string>().starts_with("N"));
  }
}

TEST_CASE("option --output of equilibrium and modes: a folder, or a file with an extension") {
  const WorkingDirectory here;
  for (const std::string command : {"equilibrium", "modes"}) {
    const std::string hold = command == "modes" ? "--equilibrium" : "--derivatives";
    const Json j = costate_json({command, kFiveBar, hold, "--output", "out"}, here.path());
    CHECK(one_object(file_text(here / ("out/" + command + ".json"))) == j);
    CHECK(one_object(file_text(here / ("out/" + command + ".json"))) ==
          costate_json({command, kFiveBar, hold, "--output", command + ".txt"}, here.path()));
    CHECK(std::filesystem::is_regular_file(here / (command + ".txt")));
  }
  write_text(here / "taken", "");
  const auto wrong = run_costate({"equilibrium", kFiveBar, "--output", "taken"}, here.path());
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, Contains("--output") && Contains("'taken") && Contains("not a directory"));
}
