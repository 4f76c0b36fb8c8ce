// The Magic Formula against points computed by others, and the .tir files that it is read from.
#include "costate/element/force/magic_formula.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "costate/kind/tyre/magic_formula.h"
#include "costate/kind/tyre/tir_file.h"
#include "costate/scene/scene.h"
#include "support/paths.h"

using namespace costate;
using Catch::Contains;

namespace {

const std::string kFile = std::string(COSTATE_MODELS_DIR) + "/tyres/formula_student_61.tir";

struct Point {
  double kappa, alpha, load, pressure, camber, Fx, Fy, Mx, My, Mz;
};

TyreOutput<double> evaluate(const MagicFormula& model, MagicFormulaOptions o, const Point& x, double speed = 10) {
  o.coefficients["INFLPRES"] = x.pressure;
  std::vector<double> p = {0};  // slip speed
  for (const auto& entry : MagicFormula::coefficients()) {
    const auto at = o.coefficients.find(entry.name);
    p.push_back(at == o.coefficients.end() ? entry.usual : at->second);
  }
  TyreOutput<double> out;
  const double size = std::abs(speed);
  model(TyreInput<double>{{x.load, speed, size * std::tan(x.alpha), x.camber, speed + size * x.kappa}},
        static_cast<const double*>(nullptr), p.data(), out, static_cast<double*>(nullptr));
  return out;
}

MagicFormulaOptions read(const std::string& path) {
  MagicFormulaOptions o;
  TyreOptions tyre;
  read_tir_file(path, o, tyre);
  return o;
}

MagicFormula with_pressure() {
  MagicFormula model;
  model.has_pressure = true;
  return model;
}

}  // namespace

TEST_CASE("magic formula: points of version 6.1") {
  // F_x, F_y, M_z of magic-formula-tyre-library (teasit, commit 642592f), executed in Octave at 10 m/s; its
  // authors' formulas in another language agree to 2e-14. Required: 1e-9, for the difference of alpha and
  // atan(tan(alpha)) and the order of operations, 1e-14, and for numbers printed to 15 digits.
  // At alpha = 0 it has sgn(alpha) = 0 where (4.E24) has alpha_y = -1.4e-3, -1.6e-3: the first two are of that, by a
  // program of its own that gives the library's numbers with its sign. The smooth sign is worth 1e-6 of the load there.
  const Point points[] = {{0.05, 0, 2000, 97000, 0, 1585.48683085389, -48.4257492408258, 0, 0, 0.051420481596407},
                          {-0.1, 0, 2750, 97000, 0, -2792.3735255244, -56.759821698945, 0, 0, 0.838603207200095},
                          {0, 0.05, 2000, 97000, 0, 9.16504853723632, -1592.1004420346, 0, 0, 39.712291423079},
                          {0, -0.1, 2750, 97000, 0, 5.95220908090243, 2535.12924740577, 0, 0, -54.3302808003036},
                          {0, 0.1, 3500, 97000, 0, 1.77020919358083, -3236.13833651925, 0, 0, 84.0814798445623}};
  const MagicFormulaOptions o = read(kFile);
  REQUIRE_FALSE(o.camber_as_angle);
  for (const Point& x : points) {
    auto out = evaluate(with_pressure(), o, x);
    CHECK(out.longitudinal() == Approx(x.Fx).epsilon(1e-9));
    const double smooth = x.alpha == 0 ? 1e-6 * x.load : 0;
    CHECK(out.lateral() == Approx(x.Fy).epsilon(1e-9).margin(smooth));
    CHECK(out.aligning() == Approx(x.Mz).epsilon(1e-9).margin(0.3 * smooth));  // times the radius
  }
}

TEST_CASE("magic formula: camber, pressure and all moments") {
  // From a program of its own for the same equations, which gives the points above to 5e-15.
  const Point points[] = {{0.05, 0.08, 2400, 97000, 0.04, 1047.33808831383, -2178.42733728206, -44.3894323146884,
                           -162.231352220259, 50.9128897095229},
                          {-0.08, -0.06, 3000, 90000, -0.03, -2503.10005294686, 1608.03606250095, -1.46727904932085,
                           -127.222538858829, -38.3595587315088},
                          {0.02, -0.12, 1800, 105000, 0.06, 164.199696634123, 1613.59992764326, 16.1790456253944,
                           -107.958791575416, -13.4031665453357},
                          {0, 0.04, 2750, 97000, -0.05, 7.01781477105573, -1784.57475841655, -69.6375584104141,
                           -167.483048249114, 34.2523809234666}};
  const MagicFormulaOptions o = read(kFile);
  for (const Point& x : points) {
    auto out = evaluate(with_pressure(), o, x);
    CHECK(out.longitudinal() == Approx(x.Fx).epsilon(1e-12));
    CHECK(out.lateral() == Approx(x.Fy).epsilon(1e-12));
    CHECK(out.overturning() == Approx(x.Mx).epsilon(1e-12));
    CHECK(out.rolling() == Approx(x.My).epsilon(1e-12));
    CHECK(out.aligning() == Approx(x.Mz).epsilon(1e-12));
    // The same tyre on the other side sees the mirror image.
    MagicFormula mirrored = with_pressure();
    mirrored.mirrored = true;
    Point y = x;
    y.alpha = -x.alpha;
    y.camber = -x.camber;
    auto other = evaluate(mirrored, o, y);
    CHECK(other.longitudinal() == out.longitudinal());
    CHECK(other.lateral() == -out.lateral());
    CHECK(other.overturning() == -out.overturning());
    CHECK(other.rolling() == out.rolling());
    CHECK(other.aligning() == -out.aligning());
    // Backwards, the trail lies on the other side and the resistance turns over; forces keep to the slips.
    auto back = evaluate(with_pressure(), o, x, -10);
    CHECK(back.lateral() == Approx(out.lateral()));
    CHECK(back.rolling() == Approx(-out.rolling()));
    CHECK(back.aligning() == Approx(-out.aligning()));  // s F_x is zero in this file
    // A wheel that rolls freely has no longitudinal force, and the side force of no longitudinal slip.
    MagicFormula free = with_pressure();
    free.free_rolling = true;
    Point still = x;
    still.kappa = 0;
    auto rolling = evaluate(free, o, x);
    CHECK(rolling.longitudinal() == 0);
    CHECK(rolling.rolling() == 0);
    CHECK(rolling.lateral() == evaluate(with_pressure(), o, still).lateral());
  }
}

TEST_CASE("magic formula: no load, no force, and no jump towards it or across zero slip") {
  const MagicFormulaOptions o = read(kFile);
  const auto at = [&](double kappa, double alpha, double load) {
    return evaluate(with_pressure(), o, {kappa, alpha, load, 97000, 0.02, 0, 0, 0, 0, 0});
  };
  for (const double load : {0.0, -100.0}) {
    auto out = at(0.1, 0.1, load);
    for (const double y : out.x) CHECK(y == 0);
  }
  for (const double y : at(0.1, 0.1, 1e-6).x) CHECK(std::abs(y) < 1e-5);
  // Both sides of alpha = 0 and kappa = 0: over 2e-9 no force changes by more than a stiffness of 1e6 N can
  // explain.
  for (std::size_t k = 0; k < 5; ++k) {
    CHECK(std::abs(at(0.03, 1e-9, 2500).x[k] - at(0.03, -1e-9, 2500).x[k]) < 2e-3);
    CHECK(std::abs(at(1e-9, 0.03, 2500).x[k] - at(-1e-9, 0.03, 2500).x[k]) < 2e-3);
  }
}

TEST_CASE("magic formula: the generation 5.2") {
  // Pure side slip written out with the older terms: F_y = D sin(C atan(..)) + S_V, S_H with PHY3 camber,
  // K = PKY1 F0 sin(2 atan(F / (PKY2 F0))) (1 - PKY3 |camber|).
  MagicFormulaOptions o;
  o.camber_as_angle = true;
  o.coefficients = {{"FNOMIN", 4000}, {"UNLOADED_RADIUS", 0.3},
                    {"PCX1", 1.6},    {"PDX1", 1.1},
                    {"PKX1", 20},     {"PCY1", 1.3},
                    {"PDY1", 0.9},    {"PDY2", -0.1},
                    {"PDY3", 2},      {"PEY1", -0.8},
                    {"PEY2", -0.6},   {"PEY3", 0.1},
                    {"PEY4", -5},     {"PKY1", -20},
                    {"PKY2", 2},      {"PKY3", 0.3},
                    {"PHY1", 0.003},  {"PHY2", 0.001},
                    {"PHY3", 0.07},   {"PVY1", 0.04},
                    {"PVY2", -0.01},  {"PVY3", -0.3},
                    {"PVY4", -0.2}};
  MagicFormula model;
  model.camber_as_angle = true;
  const double F = 3000, alpha = 0.06, gamma = 0.05, df = -0.25;
  const double K = -20 * 4000 * std::sin(2 * std::atan(F / 8000)) * (1 - 0.3 * gamma);
  const double D = (0.9 - 0.1 * df) * (1 - 2 * gamma * gamma) * F, B = K / (1.3 * D);
  const double E = (-0.8 - 0.6 * df) * (1 - (0.1 - 5 * gamma));
  const double x = B * (alpha + 0.003 + 0.001 * df + 0.07 * gamma);
  const double expected =
      D * std::sin(1.3 * std::atan(x - E * (x - std::atan(x)))) + F * (0.04 - 0.01 * df + (-0.3 - 0.2 * df) * gamma);
  auto out = evaluate(model, o, {0, alpha, F, 1, gamma, 0, 0, 0, 0, 0});
  CHECK(out.lateral() == Approx(expected).epsilon(1e-12));
}

namespace {

/// A tyre of the generation 5.2 whose slips lag over the lengths of its coefficients.
MagicFormulaOptions relaxing() {
  MagicFormulaOptions o;
  o.camber_as_angle = o.relaxation_by_coefficients = true;
  o.coefficients = {{"FNOMIN", 4000}, {"UNLOADED_RADIUS", 0.3135},
                    {"LFZO", 0.9},    {"PCX1", 1.6},
                    {"PDX1", 1.1},    {"PKX1", 20},
                    {"PCY1", 1.3},    {"PDY1", 0.9},
                    {"PKY1", -20},    {"PKY2", 2},
                    {"PKY3", 0.43},   {"PTX1", 2.3657},
                    {"PTX2", 1.4112}, {"PTX3", 0.56626},
                    {"PTY1", 2.1439}, {"PTY2", 1.9829},
                    {"LSGKP", 1.1},   {"LSGAL", 0.95}};
  return o;
}

/// The model's numbers: slip speed 0.1 m/s, initial slips 0, coefficients.
std::vector<double> numbers_of(const MagicFormulaOptions& o) {
  std::vector<double> p = {0.1, 0, 0};
  for (const auto& entry : MagicFormula::coefficients()) {
    const auto at = o.coefficients.find(entry.name);
    p.push_back(at == o.coefficients.end() ? entry.usual : at->second);
  }
  return p;
}

}  // namespace

TEST_CASE("magic formula: relaxation lengths that follow the load") {
  // sigma_kappa, sigma_alpha and their derivatives by the load from the formulas of MF-Tyre 5.2 as its
  // equation manual has them (and MFeval, which cites it), evaluated with 30 digits by a program of its own;
  // printed to 16.
  struct Row {
    double load, camber, kappa, kappa_F, alpha, alpha_F;
  };
  const Row rows[] = {
      {1500, 0, 0.2775505550617377, 0.0002119112707801448, 0.2312923783569356, 0.0001411539113589893},
      {4000, 0.04, 0.8168391816061996, 0.0002026634723264354, 0.4816910017006971, 6.287075029463397e-5},
      {6500, -0.07, 1.243817385123742, 0.0001349190689724839, 0.5549217692469817, 7.975412320636932e-6}};
  MagicFormula model;
  model.camber_as_angle = model.lags = model.lags_along = model.lags_by_load = true;
  const std::vector<double> p = numbers_of(relaxing());
  REQUIRE(model.number_count() == static_cast<int>(p.size()));
  for (const Row& x : rows) {
    INFO("at " << x.load << " N");
    const auto F = Dual<1>::variable(x.load, 0);
    const Dual<1> kappa = model.longitudinal_relaxation_length(F, p.data()),
                  alpha = model.lateral_relaxation_length(F, Dual<1>(x.camber), p.data());
    CHECK(kappa.v == Approx(x.kappa).epsilon(1e-13));
    CHECK(kappa.d[0] == Approx(x.kappa_F).epsilon(1e-13));
    CHECK(alpha.v == Approx(x.alpha).epsilon(1e-13));
    CHECK(alpha.d[0] == Approx(x.alpha_F).epsilon(1e-13));
    // The slips fall to their steady values over these lengths: sigma z' = V_slip - s z. At rest s is the
    // slip speed, and the rates are finite.
    for (const double forward : {20.0, 0.0}) {
      const double z[2] = {0.03, -0.02}, lateral = 0.7, rolling = forward + 0.4, s = forward > 0 ? forward : 0.1;
      double zdot[2];
      TyreOutput<double> out;
      model(TyreInput<double>{{x.load, forward, lateral, x.camber, rolling}}, z, p.data(), out, zdot);
      CHECK(zdot[0] == Approx((lateral - s * z[0]) / x.alpha).epsilon(1e-12));
      CHECK(zdot[1] == Approx((0.4 - s * z[1]) / x.kappa).epsilon(1e-12));
    }
  }
  // Without a load they stay at R0 / 20, which they join with their slopes: over 2e-6 N across either joint
  // the slope of at most 1e-3 m/N changes by less than its curvature (1e-6 m/N^2) explains.
  CHECK(model.lateral_relaxation_length(0.0, 0.02, p.data()) == Approx(0.05 * 0.3135).epsilon(1e-14));
  CHECK(model.longitudinal_relaxation_length(0.0, p.data()) == Approx(0.05 * 0.3135).epsilon(1e-14));
  const auto slope = [&](double load) {
    return model.lateral_relaxation_length(Dual<1>::variable(load, 0), Dual<1>(0.0), p.data());
  };
  double low = 1, high = 4000;  // of the load at which the length is R0 / 10
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (slope(middle).v < 0.1 * 0.3135 ? low : high) = middle;
  }
  CHECK(slope(low - 1e-6).v == Approx(slope(high + 1e-6).v).margin(1e-8));
  CHECK(slope(low - 1e-6).d[0] == Approx(slope(high + 1e-6).d[0]).margin(1e-11));
  CHECK(slope(1e-6).d[0] < 1e-10);
}

TEST_CASE("magic formula: a scene with relaxation by coefficients, and what it lacks") {
  const auto text = [](const std::string& tyre) {
    return R"([road.plain]
kind = "flat"
[rigid_body.wheel]
x_m = 0
y_m = 0
z_m = 0.3
vx_m_per_s = 10
mass_kg = 10
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub]
on = "wheel"
x_m = 0
y_m = 0
z_m = 0
[tyre.T]
wheel = "hub"
road = "plain"
stiffness_N_per_m = 1.6e5
model = "magic_formula"
)" + tyre + "\n[start]\ngiven = [\"wheel\"]\n";
  };
  const std::string name = std::string(COSTATE_MODELS_DIR) + "/tyres/scene.toml",
                    file = "tir_file = \"formula_student_61.tir\"\n", asks = file + "relaxation = \"coefficients\"\n",
                    lengths = "magic_formula = { PTX1 = 2, PTX2 = 1.4, PTX3 = 0.5, PTY1 = 2, PTY2 = 1.9 }";
  const auto complaint = [&](const std::string& tyre) -> std::string {
    try {
      Scene::parse(text(tyre), name);
    } catch (const Error& e) {
      return e.what();
    }
    return "none";
  };
  CHECK(complaint(asks + lengths) == "none");
  // What there is of numbers is as the scene says: initial slips, and no length of its own.
  const auto m = Scene::parse(text(asks + "initial_slip = 0.02\n" + lengths), name).mechanism();
  CHECK(m->numbers()[m->number("tyre.T.initial_slip")].value == 0.02);
  CHECK(m->forces()[0]->states() == 2);
  const auto rolling = Scene::parse(text(asks + "free_rolling = true\n" + lengths), name).mechanism();
  CHECK(rolling->forces()[0]->states() == 1);
  CHECK_THAT(complaint(asks), Contains("tyre.T.relaxation: \"coefficients\" needs PTX1, PTX2, PTX3, PTY1, PTY2, "
                                       "which neither ") &&
                                  Contains("/tyres/formula_student_61.tir nor 'magic_formula' gives. Write what is "
                                           "missing into magic_formula = { ... }, or give numbers: "
                                           "relaxation_length_m and longitudinal_relaxation_length_m."));
  CHECK_THAT(complaint(asks + "free_rolling = true\nmagic_formula = { PTY1 = 2 }"),
             Contains("\"coefficients\" needs PTY2, which neither "));
  CHECK_THAT(complaint(asks + "magic_formula = { PTX1 = 2, PTX2 = 1.4, PTX3 = 0.5, PTY1 = -2, PTY2 = 1.9 }"),
             Contains("\"coefficients\" needs a positive PTY1, found -2"));
  CHECK_THAT(complaint(asks + "relaxation_length_m = 0.3\n" + lengths),
             Contains("'relaxation_length_m' in [tyre.T] contradicts 'relaxation', which gives this length."));
  CHECK_THAT(complaint(file + "relaxation = \"file\"\n" + lengths),
             Contains("'relaxation' in [tyre.T] must be") && Contains("coefficients"));
}

TEST_CASE("magic formula: mistakes in files are named with their line") {
  const auto file = "tyre_" + std::to_string(getpid()) + ".tir";
  const auto complaint = [&](const std::string& text) -> std::string {
    std::ofstream(file) << text;
    std::string found = "none";
    try {
      read(file);
    } catch (const Error& e) {
      found = e.what();
    }
    std::remove(file.c_str());
    return found;
  };
  CHECK(complaint("[MODEL]\nFITTYP = 61 $ version\n! all of it\n") == "none");
  CHECK(complaint("FITTYP = 61\nPKY1 = -1.2e1x\n") == file + ":2:1: PKY1 must be a number, found '-1.2e1x'.");
  CHECK(complaint("FITTYP = 61\n\nPKY1\n") == file + ":3:1: Expected NAME = value, found 'PKY1'.");
  CHECK(complaint("FITTYP = 61\nPKY1 = $ none\n") == file + ":2:1: Expected NAME = value, found 'PKY1 ='.");
  CHECK(complaint("[MODEL\n") == file + ":1:1: Expected ']' at the end of '[MODEL'.");
  CHECK(complaint("PKY1 = -12\n") ==
        file + ": FITTYP is missing: it tells which Magic Formula the coefficients belong to.");
  CHECK_THAT(complaint("[MODEL]\nFITTYP = 70\n"), Contains(file + ":2:1: FITTYP must be 60, 61 or 62"));
  CHECK(complaint("[UNITS]\nLENGTH = 'mm'\n") ==
        file + ":2:1: LENGTH must be 'METER', found 'MM': convert the file to SI units.");
  CHECK(complaint("FITTYP = 61\nUNLOADED_RADIUS = -0.3\n") ==
        file + ":2:1: UNLOADED_RADIUS must be positive, found -0.3.");
  CHECK(complaint("FITTYP = 61\nLMUY = -1\n") == file + ":2:1: LMUY must not be negative, found -1.");
  CHECK_THAT(complaint("FITTYP = 6\nLGAY = 0.9\n"), Contains(file + ":2:1: LGAY other than 1 is not supported"));
  CHECK_THAT(
      [&] {
        try {
          read("no_such.tir");
        } catch (const Error& e) {
          return std::string(e.what());
        }
        return std::string();
      }(),
      Contains("no_such.tir: This tyre property file, whose path is relative to the scene, cannot be read"));
}

TEST_CASE("magic formula: a scene with a file, which single coefficients stand over") {
  const std::string text = R"([road.plain]
kind = "flat"
[rigid_body.wheel]
x_m = 0
y_m = 0
z_m = 0.19
vx_m_per_s = 10
omega_y_rad_per_s = 52
mass_kg = 10
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub]
on = "wheel"
x_m = 0
y_m = 0
z_m = 0
[tyre.T]
wheel = "hub"
road = "plain"
stiffness_N_per_m = 1.6e5
model = "magic_formula"
tir_file = "formula_student_61.tir"
magic_formula = { PDX1 = 0.9 }
[start]
given = ["wheel"]
)";
  const std::string name = std::string(COSTATE_MODELS_DIR) + "/tyres/scene.toml";  // the place that paths start from
  const Scene scene = Scene::parse(text, name);
  const auto& m = *scene.mechanism();
  const auto value = [&](const std::string& path) { return m.numbers()[m.number("tyre.T." + path)].value; };
  CHECK(value("radius_m") == 0.2025);
  CHECK(value("magic_formula.PDX1") == 0.9);
  CHECK(value("magic_formula.PKY1") == -18.9867);
  CHECK(value("magic_formula.NOMPRES") == 97000);
  CHECK_THROWS(
      m.number("tyre.T.magic_formula.INFLPRES"));  // left out: the nominal pressure is the tyre's own, one number
  // A coefficient of the file can vary as well: its new value then stands in the scene.
  const Scene changed = scene.with_number("tyre.T.magic_formula.PKY1", -20);
  CHECK(changed.mechanism()->numbers()[m.number("tyre.T.magic_formula.PKY1")].value == -20);
  try {
    Scene::parse(text, "elsewhere/scene.toml");
    FAIL("found a file that is not there");
  } catch (const Error& e) {
    CHECK_THAT(e.what(), Contains("elsewhere/formula_student_61.tir: This tyre property file, whose path is relative "
                                  "to the scene, cannot be read"));
  }
}
