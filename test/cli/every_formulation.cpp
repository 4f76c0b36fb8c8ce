// What every formulation makes, by every integrator and method that it has, of scenes on which some were wrong: the
// same reactions, or a word. Right, warned of in text and JSON, or refused with a time and a row.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "csv_table.h"
#include "process.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kCases = COSTATE_SOURCE_DIR "/test/cases/";

using Names = std::map<std::string, std::vector<std::string>>;

/// What 'costate list' has: the integrators of each formulation, and its methods but for differences of simulations.
struct Offered {
  Names integrators, methods;
  explicit Offered(const WorkingDirectory& here) {
    const Json list = costate_json({"list"}, here.path());
    for (const Json& f : list.at("formulations"))
      integrators[f.at("name").get<std::string>()] = f.at("integrators").get<std::vector<std::string>>();
    for (const Json& c : list.at("combinations"))
      if (c.at("possible") == true && c.at("method") != "differences")
        methods[c.at("formulation").get<std::string>()].push_back(c.at("method").get<std::string>());
    REQUIRE(integrators.size() == 10);
    REQUIRE(methods.size() == 10);
  }
};

}  // namespace

// By symmetry neither the bearing nor the guide carries anything sideways; the hinges and the bearing's foot carry what
// the springs (8e5 N/m with 4e4 N s/m) leave them. An error of rtol in lengths [m] and in velocities [m/s] changes
// these by 8.4e5 rtol; ten of them are what integrators leave. Fixed steps are chosen for 0.1 sqrt(rtol) of psi, and
// get that part of the largest force. IDAS stored reactions of 46 N at rtol 1e-11 where there are none.
TEST_CASE("every formulation: the reactions of the flyball governor are the same, and none where there is none") {
  const WorkingDirectory here;
  const Offered all(here);
  const std::string scene = COSTATE_MODELS_DIR "/flyball_governor/flyball_governor.toml";
  const auto reactions = [&](const std::string& formulation, const std::string& integrator, const std::string& rtol) {
    costate_json({"simulate", scene, "--t-end", "0.2", "--output-step", "0.01", "--csv", "--rtol", rtol,
                  "--formulation", formulation, "--integrator", integrator, "--output", "out"},
                 here.path());
    return read_table(file_text(here / "out/trajectory.csv"));
  };
  std::map<std::string, Table> reference;
  reference.emplace("1e-8", reactions("baumgarte", "radau9", "1e-10"));
  reference.emplace("1e-11", reactions("baumgarte", "radau9", "1e-11"));
  // Six formulations on three integrators agree in these digits.
  CHECK(reference.at("1e-11").column("multipliers/hinge.hip1.x [N]").at(10) == Approx(106.90029).margin(2e-5));
  const auto compare = [&](const std::string& formulation, const std::string& integrator, const std::string& rtol) {
    CAPTURE(formulation, integrator, rtol);
    const Table found = reactions(formulation, integrator, rtol);
    REQUIRE(found.heading == reference.at(rtol).heading);
    const double largest = 203, error = std::stod(rtol),
                 allowed = integrator == "fixed" ? 10 * std::sqrt(error) * largest : 10 * error * 8.4e5;
    int none = 0;
    for (const std::string& name : found.heading) {
      if (name.find("multipliers/") == std::string::npos) continue;
      CAPTURE(name);
      const std::vector<double> is = found.column(name), right = reference.at(rtol).column(name);
      REQUIRE(is.size() == right.size());
      const bool sideways =
          (name.find("translational.guide") != std::string::npos && name.find("turn") == std::string::npos) ||
          (name.find("hinge.bearing") != std::string::npos && name.find(".z ") == std::string::npos);
      none += sideways;
      double apart = 0, most = 0;
      for (std::size_t k = 0; k < is.size(); ++k) {
        apart = std::max(apart, std::abs(is[k] - right[k]));
        most = std::max(most, std::abs(is[k]));
      }
      CHECK(apart <= allowed);
      if (sideways) CHECK(most <= 1e-6);
    }
    CHECK(none == 8);
  };
  for (const auto& [formulation, integrators] : all.integrators)
    for (const std::string& integrator : integrators) compare(formulation, integrator, "1e-8");
  for (const char* formulation : {"index1", "index2", "index3", "baumgarte", "penalty", "maggi-implicit"})
    compare(formulation, "idas", "1e-11");
}

// A parallelogram that lies flat at 0.304876 s, where it may go on as an antiparallelogram: psi is 1.55958 by index 1
// on one integrator and 1.46781 by Maggi's coordinates, and both are motions of the scene.
TEST_CASE("every formulation: a change point is named by every method, with its row") {
  const WorkingDirectory here;
  const Offered all(here);
  for (const auto& [formulation, methods] : all.methods)
    for (const std::string& method : methods) {
      CAPTURE(formulation, method);
      const Outcome o = run_costate({"gradient", kCases + "change_point.toml", "--no-files", "--json", "--formulation",
                                     formulation, "--method", method, "--t-end", "1"},
                                    here.path());
      const Json j = one_object(o.out);
      const std::string said = j.at("warnings").dump() + (j.contains("error") ? j.at("error").get<std::string>() : "");
      CAPTURE(said);
      CHECK((o.status == 0) == (j.at("status") == "ok"));
      CHECK_THAT(said, Contains("t = 0.30") || Contains("t = 0.67"));
      CHECK_THAT(said, Contains("bar.c.length") || Contains("bar.r.length") || Contains("bar.l.length"));
      if (o.status == 0) {
        CHECK_THAT(said, Contains("passes a singular position at t = 0.30"));
        CHECK_THAT(o.err, Contains("warning: ") && Contains("passes a singular position at t = 0.30"));
      }
    }
  for (const auto& [formulation, integrators] : all.integrators)
    for (const std::string& integrator : integrators) {
      CAPTURE(formulation, integrator);
      const Outcome o = run_costate({"simulate", kCases + "change_point.toml", "--no-files", "--json", "--formulation",
                                     formulation, "--integrator", integrator, "--t-end", "0.5"},
                                    here.path());
      const Json j = one_object(o.out);
      const std::string said = j.at("warnings").dump() + (j.contains("error") ? j.at("error").get<std::string>() : "");
      CAPTURE(said);
      CHECK_THAT(said, Contains("t = 0.30") && Contains("bar."));
    }
}

// The crank turns where the rocker cannot follow: coupler and rocker are in line at 0.008518 s.
TEST_CASE("every formulation: a linkage that locks is refused, with time and row") {
  const WorkingDirectory here;
  const Offered all(here);
  for (const auto& [formulation, integrators] : all.integrators)
    for (const std::string& integrator : integrators) {
      CAPTURE(formulation, integrator);
      const Json j = costate_json({"simulate", kCases + "locked_linkage.toml", "--no-files", "--formulation",
                                   formulation, "--integrator", integrator},
                                  here.path(), 1);
      const std::string error = j.at("error").get<std::string>();
      CAPTURE(error);
      CHECK_THAT(error, Contains("t = 0.008") || Contains("t = 0.009"));
      CHECK_THAT(error, Contains("bar.rocker.length") || Contains("bar.coupler.length"));
    }
  for (const auto& [formulation, methods] : all.methods)
    for (const std::string& method : methods) {
      CAPTURE(formulation, method);
      const Json j = costate_json(
          {"gradient", kCases + "locked_linkage.toml", "--no-files", "--formulation", formulation, "--method", method},
          here.path(), 1);
      CHECK_THAT(j.at("error").get<std::string>(), Contains("t = 0.008") || Contains("t = 0.009"));
    }
}
