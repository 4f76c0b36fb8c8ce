// Where branches of cycles meet others: located as folds and flips are, and named where the parameter turns though no
// multiplier crosses.
#include <catch2/catch.hpp>
#include <cmath>

#include "process.h"
#include "turning_disk.h"

using costate::test::costate_json;
using costate::test::turning_disk;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;

namespace {

Json branch_of(const std::string& couple, const std::string& angle, const std::string& number,
               const std::string& range) {
  const WorkingDirectory here;
  write_text(here / "disk.toml", turning_disk(couple, angle, "[cycle]\nperiod_s = 6.283185307179586\nsettle = 20\n"));
  return costate_json({"cycle", "disk.toml", "--no-files", "--parameters", number, "--continue", number + "=" + range},
                      here.path())
      .at("bifurcations");
}

Json of_kind(const Json& all, const std::string& kind) {
  Json r = Json::array();
  for (const Json& b : all)
    if (b.at("kind") == kind) r.push_back(b);
  return r;
}

}  // namespace

// A symmetric Duffing oscillator. Over half a period with x -> -x its symmetric cycle is regular there, and the branch
// point a flip of that map: by scipy (Dormand and Prince of order 8, rtol 1e-12) 2.7157985.
TEST_CASE("branch points: the symmetric cycle of Duffing's oscillator loses its symmetry") {
  const Json found = of_kind(branch_of("formula = \"-d.angle - d.angle^3 - 0.2*d.angle_dot + a*cos(t)\"\na = 2.2",
                                       "0.1", "couple.k.a", "2..3.2"),
                             "branch point");
  REQUIRE(found.size() >= 1);
  const double error = found[0].at("parameter_error").get<double>();
  CHECK(std::abs(found[0].at("parameter").get<double>() - 2.7157985) <= std::max(error, 1e-6));
  CHECK(error < 2e-3);
}

// Parametrically excited, with cycles of twice the period that grow out of the flip of rest at e = 0.225155562 (a
// bisection of the monodromy by scipy) either way: the branch goes down to it and up again on its mirror image.
TEST_CASE("branch points: a branch turns round where it touches rest") {
  const Json found =
      of_kind(branch_of("formula = \"-(1.05 + e*cos(2*t))*d.angle - 0.1*d.angle_dot - 0.5*d.angle^3\"\ne = 0.4", "0.5",
                        "couple.k.e", "0.1..0.5"),
              "branch point");
  REQUIRE(found.size() == 1);
  const double error = found[0].at("parameter_error").get<double>();
  CHECK(std::abs(found[0].at("parameter").get<double>() - 0.225155562) <= std::max(error, 1e-7));
  CHECK(error < 1e-4);
}
