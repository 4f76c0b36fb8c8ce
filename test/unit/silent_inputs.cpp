// Inputs that were taken without a word and meant something else than they say.
#include <fmt/format.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/kind/tyre/magic_formula.h"
#include "costate/scene/scene.h"

using namespace costate;
using Catch::Contains;

namespace {
const std::string kBody =
    "[body.b]\nmass_kg = 1\ninertia_kg_m2 = 1\nx_m = 0\ny_m = 0\nangular_velocity_rad_per_s = 6.283185307179586\n"
    "[run]\nt_end_s = 2\n";
std::string measured(const std::string& unit, const std::string& of) {
  return kBody + fmt::format(
                     "[data.d]\ncolumns = [\"t [s]\", \"f [{}]\"]\nrows = [[0, 1], [1, 1]]\n"
                     "[output.rate]\nformula = \"b.angle_dot\"\nunit = \"1/s\"\n"
                     "[[cost.samples]]\ndata = \"d\"\ncolumn = \"f\"\noutput = \"{}\"\nsigma = 1\n",
                     unit, of);
}
}  // namespace

TEST_CASE("silent inputs: turns a second are no radians a second") {
  CHECK_THROWS_WITH(Scene::parse(measured("Hz", "b.angle_dot"), "s.toml"),
                    Contains("s.toml") && Contains("rad/s or rpm"));
  CHECK_THROWS_WITH(Scene::parse(measured("1/min", "rate"), "s.toml"), Contains("in Hz"));
  CHECK_NOTHROW(Scene::parse(measured("rpm", "b.angle_dot"), "s.toml"));
  CHECK_NOTHROW(Scene::parse(measured("rad/s", "rate"), "s.toml"));
  CHECK_NOTHROW(Scene::parse(measured("Hz", "rate"), "s.toml"));
}

TEST_CASE("silent inputs: a number twice in one parameter, steps that do not rise") {
  CHECK_THROWS_WITH(
      Scene::parse(kBody + "[parameter.a]\nnumbers = [\"body.b.mass_kg\", \"body.b.mass_kg\"]\n", "s.toml"),
      Contains("s.toml") && Contains("'body.b.mass_kg' is listed twice"));
  CHECK_THROWS_WITH(Scene::parse(kBody + "[couple.c]\nangle = \"b.angle\"\ntorque_N_m = { kind = \"steps\", at = "
                                         "[0.5, 0.4], values = [0, 1, 3], width = 0.1 }\n",
                                 "s.toml"),
                    Contains("'at' must increase"));
}

TEST_CASE("silent inputs: data over cycles a second is no function of radians a second") {
  const auto scene = [](const char* unit) {
    return kBody +
           fmt::format(
               "[data.e]\ntimed = false\ncolumns = [\"speed [{}]\", \"torque [N m]\"]\n"
               "rows = [[0, 0], [1, 1], [10, 10]]\n"
               "[couple.c]\nangle = \"b\"\nformula = \"f(b.angle_dot)\"\n"
               "f = {{ kind = \"data\", data = \"e\", column = \"torque\", over = \"speed\", beyond = \"hold\" }}\n",
               unit);
  };
  CHECK_THROWS_WITH(Scene::parse(scene("Hz"), "s.toml"), Contains("s.toml") && Contains("cycles a second"));
  for (const char* unit : {"rpm", "rad/s", "1"}) CHECK_NOTHROW(Scene::parse(scene(unit), "s.toml"));
}

TEST_CASE("silent inputs: a tyre's coefficients that no equation here has are told of") {
  const auto file = "left_out_" + std::to_string(getpid()) + ".tir";
  std::ofstream(file) << "FITTYP = 62\nQSX1 = 0.1\nQSX12 = 0.5\nQSX13 = 0\nQSX14 = 0.2\nUSE_MODE = 124\n";
  MagicFormulaOptions o;
  TyreOptions tyre;
  take_notices();
  read_tir_file(file, o, tyre);
  std::remove(file.c_str());
  const auto said = take_notices();
  REQUIRE(said.size() == 1);
  CHECK_THAT(said.front(), Contains("QSX12, QSX14 have no part"));
}

namespace {
/// What is said of a scene with this file and these coefficients besides; or why it is refused.
std::vector<std::string> said_of(const std::string& tir, const std::string& own = "") {
  const auto file = "misspelt_" + std::to_string(getpid()) + ".tir";
  std::ofstream(file) << tir;
  take_notices();
  std::vector<std::string> said;
  try {
    Scene::parse(
        "[road.r]\nkind = \"flat\"\n[rigid_body.w]\nx_m = 0\ny_m = 0\nz_m = 0.3\nmass_kg = 9\n"
        "inertia_xx_kg_m2 = 1\ninertia_yy_kg_m2 = 1\ninertia_zz_kg_m2 = 1\n[point.c]\non = \"w\"\nx_m = 0\n"
        "y_m = 0\nz_m = 0\n[tyre.T]\nwheel = \"c\"\nroad = \"r\"\nmodel = \"magic_formula\"\nfree_rolling = "
        "true\ntir_file = \"" +
            file + "\"\n" + own + "\n[start]\ngiven = [\"w\"]\n",
        "s.toml");
    said = take_notices();
  } catch (const Error& e) {
    said = {e.what()};
  }
  std::remove(file.c_str());
  return said;
}
const std::string kShort =
    "[UNITS]\nMASS = 'kg'\nPRESSURE = 'Pa'\n[MODEL]\nFITTYP = 6\n[INERTIA]\nMASS = 9.3\n[DIMENSION]\n"
    "UNLOADED_RADIUS = 0.3\n[VERTICAL]\nFNOMIN = 4000\nVERTICAL_STIFFNESS = 2e5\n[LATERAL_COEFFICIENTS]\n"
    "PCX1 = 1.6\nPDX1 = 1\nPDX2 = 0\nPDX3 = 0\nPEX1 = 0\nPEX2 = 0\nPEX3 = 0\nPEX4 = 0\nPKX1 = 20\nPKX2 = 0\nPKX3 = 0\n"
    "PHX1 = 0\nPHX2 = 0\nPVX1 = 0\nPVX2 = 0\nPCY1 = 1.3\nPDY1 = 0.9\nPDY3 = 0\nPEY1 = 0\nPEY2 = 0\nPEY3 = 0\n"
    "PEY4 = 0\nPKY1 = -20\nPKY2 = 2\nPKY3 = 0\nPHY1 = 0\nPHY2 = 0\nPHY3 = 0\nPVY1 = 0\nPVY2 = 0\nPVY3 = 0\nPVY4 = 0\n";
}  // namespace

// PDYY2 for PDY2 changed psi from 5.50 to 5.46 without a word; a key that was given twice had its last value.
TEST_CASE("silent inputs: a tyre file's coefficients that are misspelt, missing, or given twice") {
  // The tyre's mass is none of the units, and forces of which the file has nothing are not missed.
  CHECK(said_of(kShort + "PDY2 = -0.1\n").empty());
  const auto misspelt = said_of(kShort + "PDYY2 = -0.1\n");
  REQUIRE(misspelt.size() == 2);
  CHECK_THAT(misspelt[0],
             Contains("there is no coefficient PDYY2, and PDY2, which is one letter from it, is not given"));
  CHECK_THAT(misspelt[1], Contains("does not give PDY2, which is taken as zero"));
  // In the scene it may stand as well.
  CHECK(said_of(kShort, "magic_formula = { PDY2 = -0.1 }").empty());
  const auto combined = said_of(kShort + "PDY2 = -0.1\nRBY1 = 8\nRCY1 = 1\n");
  REQUIRE(combined.size() == 1);
  CHECK_THAT(combined[0], Contains("does not give RBY2, RBY3, REY1, REY2, RHY1, RHY2, RVY1, RVY2"));
  // 6.1 has some more.
  std::string newer = kShort + "PDY2 = -0.1\n";
  newer.replace(newer.find("FITTYP = 6"), 10, "FITTYP = 61");
  const auto of_61 = said_of(newer);
  REQUIRE(of_61.size() == 1);
  CHECK_THAT(of_61[0], Contains("does not give PEY5, PKY4 (taken as 2), PKY5, PKY6, PKY7, which are taken as zero"));
  const auto load = said_of(kShort + "PDY2 = -0.1\nQ_FZ2 = 15\nQ_V1 = 0\n");
  REQUIRE(load.size() == 1);
  CHECK_THAT(load[0], Contains("Q_FZ2 has no part in the equations"));
  const auto twice = said_of(kShort + "PDY2 = -0.1\n\nPDY2 = -0.2\n");
  REQUIRE(twice.size() == 1);
  CHECK_THAT(twice[0], Contains(".tir:48:1: PDY2 has another value in line 46, -0.1: keep one of the two."));
  CHECK(said_of(kShort + "PDY2 = -0.1\nPDY2 = -0.1\nTYPE = 1\nTYPE = 2\n").empty());
  CHECK_THAT(said_of("[UNITS]\nPRESSURE = 'bar'\n")[0], Contains(".tir:2:1: PRESSURE must be 'PASCAL', found 'BAR'"));
}
