// What other programs read: with --json every command prints exactly one object on standard output, with these keys
// and types, whatever happens.
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "five_bar.h"
#include "process.h"

using costate::test::costate_json;
using costate::test::kFiveBar;
using costate::test::one_object;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

namespace {

void check_number_object(const Json& j, const std::set<std::string>& names) {
  REQUIRE(j.is_object());
  std::set<std::string> found;
  for (const auto& [name, value] : j.items()) {
    INFO(name);
    CHECK(value.is_number());
    found.insert(name);
  }
  CHECK(found == names);
}

/// The keys that every summary of a run has.
void check_run(const Json& j) {
  INFO(j.dump(1));
  CHECK(j.at("psi").is_number());
  check_number_object(j.at("parameters"), {"L01", "L02"});
  CHECK(j.contains("gradient"));
  CHECK(j.contains("gradient_error"));
  CHECK(j.at("formulation") == "index1");
  CHECK((j.at("integrator") == "idas" || j.at("integrator") == "cvodes"));
  CHECK(j.contains("method"));
  CHECK(j.at("rtol").get<double>() == 1e-8);
  REQUIRE(j.at("counters").is_object());
  for (const auto& [name, value] : j.at("counters").items()) {
    INFO(name);
    CHECK(value.is_number_integer());
  }
  CHECK(j.at("counters").at("steps").get<long>() > 0);
  CHECK(j.at("wall_s").get<double>() > 0);
  CHECK(j.at("status") == "ok");
  CHECK(j.at("settings").at("t_end_s") == 5);
  for (const char* library : {"costate", "sundials", "nlopt", "eigen"})
    CHECK(j.at("settings").at("versions").at(library).is_string());
}

}  // namespace

TEST_CASE("simulate: keys and types") {
  const WorkingDirectory here;
  const Json j = costate_json({"simulate", kFiveBar}, here.path());
  check_run(j);
  CHECK(j.at("gradient").is_null());
  CHECK(j.at("gradient_error").is_null());
  CHECK(j.at("method").is_null());
}

TEST_CASE("gradient: keys and types") {
  const WorkingDirectory here;
  const Json j = costate_json({"gradient", kFiveBar}, here.path());
  check_run(j);
  check_number_object(j.at("gradient"), {"L01", "L02"});
  check_number_object(j.at("gradient_error"), {"L01", "L02"});  // by the run that confirms it
  CHECK(j.at("psi_error").is_number());
  CHECK(j.at("method") == "idas-adjoint");
  const Json once = costate_json({"gradient", kFiveBar, "--no-confirm", "--no-files"}, here.path());
  CHECK(once.at("gradient_error").is_null());
  CHECK(once.at("psi_error").is_null());
}

TEST_CASE("gradient: without parameters it says so, with those that the scene names") {
  const WorkingDirectory here;
  const auto r =
      costate::test::run_costate({"gradient", kFiveBar, "--no-files", "--set", "run.parameters=[]"}, here.path());
  CHECK(r.err.find("no parameter to differentiate by") != std::string::npos);
  CHECK(r.err.find("--parameters L01,L02") != std::string::npos);
}

TEST_CASE("gradient: the estimate of its own error, on request, of a confirmed run and by differences") {
  const WorkingDirectory here;
  for (const std::string method : {"idas-forward", "cvodes-adjoint", "differences"}) {
    INFO(method);
    for (const std::string more : {"", "--estimate-error", "--no-confirm"}) {
      INFO(more);
      std::vector<std::string> words{"gradient", kFiveBar, "--no-files", "--method", method};
      if (!more.empty()) words.push_back(more);
      const Json j = costate_json(words, here.path());
      if (more == "--no-confirm" && method != "differences") {
        CHECK(j.at("gradient_error").is_null());
        continue;
      }
      check_number_object(j.at("gradient_error"), {"L01", "L02"});
      for (const auto& [name, estimate] : j.at("gradient_error").items()) {
        // An estimate, but of the right size: the true error is not far beyond it.
        const double error = std::abs(j.at("gradient").at(name).get<double>() - costate::test::kGradient.at(name));
        CHECK(estimate.get<double>() > 0);
        CHECK(estimate.get<double>() < 1e-4);
        CHECK(error < 10 * estimate.get<double>() + 1e-9);
      }
    }
  }
}

TEST_CASE("optimize: keys and types") {
  const WorkingDirectory here;
  const Json j = costate_json({"optimize", kFiveBar}, here.path());
  check_run(j);
  check_number_object(j.at("gradient"), {"L01", "L02"});
  CHECK(j.at("gradient_error").is_null());
  CHECK(j.at("method") == "idas-adjoint");
  CHECK(j.at("stop_reason").is_string());
  CHECK(j.at("initial").at("psi").is_number());
  check_number_object(j.at("initial").at("parameters"), {"L01", "L02"});
  check_number_object(j.at("initial").at("gradient"), {"L01", "L02"});
  REQUIRE(j.at("evaluations").is_array());
  REQUIRE(!j.at("evaluations").empty());
  int index = 0;
  for (const Json& e : j.at("evaluations")) {
    CHECK(e.at("index") == ++index);
    CHECK(e.at("psi").is_number());
    check_number_object(e.at("parameters"), {"L01", "L02"});
    check_number_object(e.at("gradient"), {"L01", "L02"});
    CHECK(e.at("counters").is_object());
    CHECK(e.at("wall_s").get<double>() > 0);
  }
  CHECK(j.at("initial").at("psi") == j.at("evaluations").at(0).at("psi"));
}

TEST_CASE("check: keys and types") {
  const WorkingDirectory here;
  const Json j = costate_json(
      {"check", kFiveBar, "--formulations", "index1,index2", "--methods", "idas-adjoint,cvodes-forward", "--no-files"},
      here.path());
  CHECK(j.at("status") == "ok");
  CHECK(j.at("psi").is_number());
  check_number_object(j.at("parameters"), {"L01", "L02"});
  REQUIRE(j.at("rows").is_array());
  CHECK(j.at("rows").size() == 4);
  for (const Json& row : j.at("rows")) {
    INFO(row.dump(1));
    const bool refused = row.at("formulation") == "index2" && row.at("method") == "cvodes-forward";
    CHECK(row.at("status") == (refused ? "refused" : "ok"));
    check_number_object(row.at("parameters"), {"L01", "L02"});
    CHECK(row.at("rtol") == 1e-8);
    CHECK(row.at("counters").is_object());
    CHECK(row.at("wall_s").is_number());
    CHECK(row.at("gradient_error").is_null());
    for (const char* key : {"psi", "gradient", "error", "integrator", "time_ratio"})
      CHECK(row.at(key).is_null() == refused);
    if (refused) {
      CHECK(row.at("refused").get<std::string>().find("idas-forward") != std::string::npos);
      continue;
    }
    check_number_object(row.at("gradient"), {"L01", "L02"});
    CHECK(row.at("error").get<double>() < 1e-5);
    CHECK(row.at("time_ratio").get<double>() > 0);
  }
}

TEST_CASE("list and dump: one object as well") {
  const WorkingDirectory here;
  const Json all = costate_json({"list"}, here.path());
  CHECK(all.at("status") == "ok");
  std::set<std::string> formulations, methods;
  for (const Json& f : all.at("formulations")) formulations.insert(f.at("name").get<std::string>());
  for (const Json& m : all.at("methods")) methods.insert(m.at("name").get<std::string>());
  for (const char* name : {"index1", "index2", "baumgarte", "penalty"}) CHECK(formulations.count(name) == 1);
  for (const char* name : {"idas-forward", "idas-adjoint", "cvodes-forward", "cvodes-adjoint", "differences"})
    CHECK(methods.count(name) == 1);
  CHECK(all.at("combinations").size() == formulations.size() * methods.size());

  const Json scene = costate_json({"list", kFiveBar}, here.path());
  CHECK(scene.at("parameters").size() == 8);
  CHECK(scene.at("parameters").at("L01").at("upper") == 4);
  CHECK(scene.at("default_parameters") == Json({"L01", "L02"}));
  CHECK(scene.at("numbers").at("spring.S1.stiffness_N_per_m") == 100);

  const Json dump = costate_json({"dump", kFiveBar}, here.path());
  CHECK(dump.at("scene").get<std::string>().find("[spring.S1]") != std::string::npos);
}

TEST_CASE("failures: what was noticed on the way comes with them") {
  // A four-bar that is assembled far from its first guess, and locks when its crank is turned.
  const WorkingDirectory here;
  costate::test::write_text(here / "scene.toml", R"([point]
A = { ground = true, x_m = 0, y_m = 0 }
D = { ground = true, x_m = 1, y_m = 0 }
B = { x_m = 0, y_m = 0.3 }
C = { x_m = 0.7, y_m = 0.8 }

[bar.crank]
from = "A"
to = "B"
length_m = 0.75
mass_kg = 1

[bar.coupler]
from = "B"
to = "C"
length_m = 0.9
mass_kg = 2

[bar.rocker]
from = "C"
to = "D"
length_m = 0.72
mass_kg = 2

[angle.crank]
from = "A"
to = "B"

[driver.motor]
coordinate = "crank.angle"
law = { kind = "polynomial", coefficients = [0, 6] }

[[cost.running]]
kind = "square"
output = "C.x"

[parameter.m]
number = "bar.rocker.mass_kg"

[run]
t_end_s = 1
)");
  for (const std::string command : {"simulate", "gradient"}) {
    INFO(command);
    const auto o = costate::test::run_costate({command, "scene.toml", "--json", "--no-files"}, here.path());
    CHECK(o.status == 1);
    const Json j = costate::test::one_object(o.out);
    INFO(j.dump(1));
    CHECK(j.at("status") == "failed");
    const auto warnings = j.at("warnings").get<std::vector<std::string>>();
    REQUIRE_FALSE(warnings.empty());
    CHECK(warnings[0].find("'C.x' at 1.4582 m, far from its first guess 0.7 m") != std::string::npos);
    CHECK(o.err.find("warning: " + warnings[0]) != std::string::npos);
  }
}

TEST_CASE("failures: one object, too, that says why") {
  const WorkingDirectory here;
  const auto failure = [&](const std::vector<std::string>& arguments, int status, const std::string& about,
                           const std::vector<std::string>& warnings = {}) {
    const Json j = costate_json(arguments, here.path(), status);
    INFO(j.dump(1));
    CHECK(j.at("status") == "failed");
    CHECK(j.at("error").get<std::string>().find(about) != std::string::npos);
    CHECK(j.at("warnings") == Json(warnings));
    // A failure of a run names, besides, the place of the guide.
    CHECK(j.size() == (j.contains("guide") ? 4 : 3));
    return j;
  };
  for (const std::string command : {"simulate", "gradient", "optimize", "check", "list", "dump"}) {
    INFO(command);
    failure({command, "missing.toml"}, 1, "missing.toml");
    failure({command, kFiveBar, "--frobnicate"}, 2, "--frobnicate");
  }
  failure({"simulate", kFiveBar, "--rtol", "many"}, 2, "--rtol");
  failure({"simulate"}, 2, "scene");
  failure({"simulte", kFiveBar}, 2, "Did you mean 'simulate'?");
  failure({}, 2, "subcommand");
  // A simulation that cannot be carried on: too large a force for any step size.
  const Json run = failure({"simulate", kFiveBar, "--set", "gravity.y_m_per_s2=-1e300"}, 1, "t =");
  CHECK(run.at("guide") == "apps/README.md#step-gets-too-small");
  // An optimization cannot start outside its parameter's bounds, where other runs may.
  failure({"optimize", kFiveBar, "--parameters", "k1", "--set", "spring.S1.stiffness_N_per_m=2000"}, 1,
          "outside the bounds 1 .. 1000",
          {"Parameter 'k1' starts at 2000, above its upper bound 1000 for optimization."});
}

TEST_CASE("a file name that is no UTF-8 does not spoil the object") {
  const WorkingDirectory here;
  const std::string name = "f\xfcnf.toml";
  costate::test::write_text(here / name, costate::test::file_text(kFiveBar));
  const Json j = costate_json({"simulate", name, "--output", "out"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(costate_json({"simulate", "\xfc.toml"}, here.path(), 1).at("status") == "failed");
}

TEST_CASE("the summary on disk is the object on standard output") {
  const WorkingDirectory here;
  for (const std::string command : {"simulate", "gradient", "optimize"}) {
    INFO(command);
    const Json printed = costate_json({command, kFiveBar, "--output", "out"}, here.path());
    CHECK(Json::parse(costate::test::file_text(here / ("out/" + command + ".json"))) == printed);
  }
}
