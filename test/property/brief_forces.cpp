// Forces and costs that are formulas of where the motion is and act for a short part of the way: a mass that flies
// along x at 1 m/s, whatever acts along y, so that the impulse and the cost are integrals over x, which are known. Not
// where the mass starts, but far along the way, when the steps of every integrator have grown to seconds.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "costate/element/law/formula_law.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using Catch::Detail::Approx;

namespace {

constexpr double kVy = 0.1;

/// 10 s; `formula` is the force along y, or a running cost.
std::string flight(const std::string& formula, const std::string& laws, bool as_cost) {
  std::string text = R"([point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1
vy_m_per_s = 0.1
[mass.bob]
point = "P"
mass_kg = 1
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.y_dot"
[run]
t_end_s = 10
)";
  if (as_cost)
    return text + "[output.o]\nunit = \"1\"\nformula = \"" + formula + "\"\n" + laws +
           "[[cost.running]]\nkind = \"value\"\noutput = \"o\"\n";
  return text + "[force.f]\npoint = \"P\"\nformula_y_N = \"" + formula + "\"\n" + laws;
}

// What acts over a part w of the way about `at`, its formula in 'X' and its integral over X; exact but for what is
// smaller than rounding of it, as all have died away at both ends.
struct Act {
  const char* name;
  std::function<std::string(double at, double w)> formula, laws;
  double integral;  // in w, for a height of one
};

std::string none(double, double) { return ""; }

const std::vector<Act>& acts() {
  static const std::vector<Act> all = {
      {"a tent by max and abs",
       [](double at, double w) { return fmt::format("max(0, 1 - abs(X - {:.17g})/{:.17g})", at, w); }, none, 1},
      {"a parabola by max",
       [](double at, double w) { return fmt::format("max(0, 1 - ((X - {:.17g})/{:.17g})^2)", at, w); }, none, 4.0 / 3},
      {"a bell", [](double at, double w) { return fmt::format("exp(-((X - {:.17g})/{:.17g})^2)", at, w); }, none,
       std::sqrt(4 * std::atan(1.0))},
      {"a plateau",
       [](double at, double w) {
         return fmt::format("0.5*(tanh(10*(X - {:.17g})/{:.17g}) - tanh(10*(X - {:.17g})/{:.17g}))", at, w, at + w, w);
       },
       none, 1},
      {"two ramps by min and max",
       [](double at, double w) {
         return fmt::format("min(max((X - {0:.17g})/{2:.17g}, 0), max(0, ({1:.17g} - X)/{2:.17g}))", at - w, at + w, w);
       },
       none, 1},
      {"a table of lines", [](double, double) { return "tent(X)"; },
       [](double at, double w) {
         return fmt::format(
             "tent = {{ kind = \"data\", x = [-20.0, {:.17g}, {:.17g}, {:.17g}, 30.0], y = [0, 0, 1, 0, 0], "
             "between = \"lines\" }}\n",
             at - w, at, at + w);
       },
       1},
      {"a map of lines", [](double, double) { return "tent(P.y, X)"; },
       [](double at, double w) {
         return fmt::format(
             "tent = {{ kind = \"map\", x = [-50.0, 50.0], y = [-20.0, {:.17g}, {:.17g}, {:.17g}, 30.0], "
             "z = [[0, 0], [0, 0], [1, 1], [0, 0], [0, 0]], between = \"lines\", beyond = \"hold\" }}\n",
             at - w, at, at + w);
       },
       1},
  };
  return all;
}

struct Way {
  const char* x;  // as a formula; goes from 0 to 10 while the mass does
  double (*rate)(double X);
};

const std::vector<Way>& ways() {
  static const std::vector<Way> all = {
      {"P.x", [](double) { return 1.0; }},
      {"(t*P.x/10)", [](double X) { return std::sqrt(10 * X) / 5; }},
  };
  return all;
}

std::string with(std::string formula, const std::string& x) {
  for (auto at = formula.find('X'); at != std::string::npos; at = formula.find('X')) formula.replace(at, 1, x);
  return formula;
}

}  // namespace

TEST_CASE("brief forces: every shape, wherever it is and however long", "[touch]") {
  const auto [formulation, integrator] = GENERATE(table<std::string, std::string>({{"baumgarte", "idas"},
                                                                                   {"index2", "idas"},
                                                                                   {"maggi", "cvodes"},
                                                                                   {"penalty", "cvodes"},
                                                                                   {"index1", "dopri5"},
                                                                                   {"maggi", "dop853"},
                                                                                   {"baumgarte", "radau5"}}));
  int k = 0;
  for (const Act& act : acts())
    for (const Way& way : ways())
      for (const double w : {0.003, 0.05, 0.4})
        for (const bool as_cost : {false, true}) {
          // Places without any order, and a height by which each gives an impulse of about 0.5 N s.
          const double at = 2.5 + 6 * std::fmod(0.618034 * ++k, 1.0), height = 0.5 / w;
          const double rtol = k % 3 == 0 ? 1e-4 : k % 3 == 1 ? 1e-6 : 1e-9;
          // dt = dX / rate: constant over the shape where X is P.x; else of P.x alone, whose integrals are known.
          if (way.rate(1) != 1 && w > 0.01) continue;
          CAPTURE(formulation, integrator, act.name, way.x, w, at, rtol, as_cost);
          Problem p = make_problem(Scene::parse(
              flight(with(fmt::format("{:.17g}*{}", height, act.formula(at, w)), way.x), act.laws(at, w), as_cost),
              "flight.toml"));
          p.formulation = formulation;
          p.solver.integrator = integrator;
          p.solver.rtol = rtol;
          const Simulation run = simulate(p, p.parameters.values());
          // Of a shape that moves by w the rate changes by w/2X at most, of signs that cancel but for its square, of
          // the plateau's middle, w/2 behind `at`, by half of it.
          const double middle = std::string(act.name) == "a plateau" ? at + w / 2 : at;
          const double expected = kVy + height * act.integral * w / way.rate(middle);
          const double curved = way.rate(1) == 1 ? 0 : std::pow(w / at, 2);
          // Each step is right to rtol, of v or of the cost; and IDAS chooses steps by an estimate.
          const double size = std::max(1.0, expected), steps = static_cast<double>(run.counters.steps);
          CHECK(std::abs(run.psi - expected) <= rtol * steps * size + curved);
          CHECK(run.counters.steps < 1500);
        }
}

TEST_CASE("brief forces: none is lost in what changes all the way", "[touch]") {
  for (const char* integrator : {"idas", "cvodes", "dopri5", "dop853", "radau5"})
    for (const double at : {3.3, 4.17, 5.104, 6.98, 7.77})
      for (const double rtol : {1e-4, 1e-6, 1e-8}) {
        CAPTURE(integrator, at, rtol);
        // 0.78 N s of 16.
        Problem p = make_problem(Scene::parse(
            flight(fmt::format("max(0, 0.45*(1 - abs(P.x - {})/1.74)) - 0.05*P.x^2", at), "", false), "flight.toml"));
        p.formulation = "index1";
        p.solver.integrator = integrator;
        p.solver.rtol = rtol;
        const Simulation run = simulate(p, p.parameters.values());
        const double expected = kVy + 0.45 * 1.74 - 0.05 * 1000 / 3;
        // A step across one of the three kinks is cut where it is off a cubic by more than a part of what the force
        // changes there, 0.7 N a second at most; 0.3 s of that is lost at worst, where 0.78 N s are to be found.
        const double kinks = 3 * 0.02 * std::pow(rtol / 1e-4, 0.125) * 0.7 * 0.3 * 0.3;
        CHECK(std::abs(run.psi - expected) <=
              rtol * static_cast<double>(run.counters.steps) * std::abs(expected) + kinks);
      }
}

TEST_CASE("brief forces: a long step's tables, and steps too short to tell", "[touch]") {
  // A wheel whose torque is a map of its speed and angle, of straight lines, with held edges; its speed reaches a line
  // of the map and follows it for a while. Every step bends there, and looks at shorter and shorter ones find positions
  // that differ by rounding alone: the run must get on.
  const std::string map =
      "{ kind = \"map\", x = [-41.8879020478639, -10.471975511966, 0.0, 15.707963267949, 52.3598775598299], "
      "y = [-1.5707963267949, -0.523598775598299, 0.174532925199433, 1.0471975511966, 2.0943951023932], "
      "z = [[0.612, -0.065, 0.068, -0.117, 0.007], [-0.767, -0.606, -0.106, 0.145, 0.464], [0.125, -0.07, -0.084, "
      "-0.072, 0.164], [-0.17, -0.26, -0.2, 0.287, -0.152], [-0.136, 0.997, -0.317, -0.06, -0.055]], "
      "between = \"lines\", beyond = \"hold\" }";
  Problem p = make_problem(Scene::parse(fmt::format(R"toml([gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[body.w]
x_m = 0
y_m = 0
angle_rad = 0.3
angular_velocity_rad_per_s = 9
mass_kg = 2
inertia_kg_m2 = 0.2
center_y_m = -0.1
[point.P]
on = "w"
x_m = 0
y_m = 0
[revolute.j]
points = ["A", "P"]
[couple.e]
angle = "w"
formula = "torque(w.angle_dot, w.angle)"
torque = {0}
[output.m]
formula = "torque(w.angle_dot, w.angle)"
unit = "N m"
torque = {0}
[start]
given = ["w.angle"]
[[cost.running]]
kind = "square"
output = "m"
[run]
t_end_s = 8
rtol = 1e-10
)toml",
                                                    map),
                                        "wheel.toml"));
  const auto run = [&](const char* formulation, const char* integrator, double rtol) {
    p.formulation = formulation;
    p.solver.integrator = integrator;
    p.solver.rtol = rtol;
    return simulate(p, p.parameters.values());
  };
  const double oracle = run("maggi", "dop853", 1e-12).psi;
  for (const char* formulation : {"index1", "baumgarte", "index2", "penalty", "maggi"})
    for (const double rtol : {1e-8, 1e-9, 1e-10}) {
      CAPTURE(formulation, rtol);
      const Simulation r = run(formulation, std::string(formulation) == "maggi" ? "cvodes" : "idas", rtol);
      CHECK(r.counters.steps < 10'000);
      CHECK(std::abs(r.psi - oracle) <= rtol * static_cast<double>(r.counters.steps) * oracle);
    }
}

TEST_CASE("formula rounding: a bound of what it makes of the value, and hardly more", "[touch]") {
  // By long doubles; the bound counts each operation's error by its largest.
  struct Case {
    const char* formula;
    long double (*exact)(long double);
  };
  for (const Case& c :
       {Case{"1e8 + x - 1e8", [](long double x) { return x; }},
        {"12.5*(tanh(17 + x) - tanh(18 + x))",
         [](long double x) { return 12.5L * (std::tanh(17 + x) - std::tanh(18 + x)); }},
        {"exp(30 + x)/exp(29) - exp(1)*exp(x)",
         [](long double x) { return std::exp(30 + x) / std::exp(29.0L) - std::exp(1.0L) * std::exp(x); }},
        {"sin(1e6*(1 + x))", [](long double x) { return std::sin(1e6L * (1 + x)); }}}) {
    const FormulaLaw law(c.formula, {});
    double off = 0, bound = 0;
    for (int k = 0; k < 200; ++k) {
      const double x = std::fmod(0.618034 * k, 1.0), error = law.rounding(x, nullptr);
      CAPTURE(c.formula, x);
      const double d = std::abs(static_cast<double>(law.value(x, nullptr) - c.exact(static_cast<long double>(x))));
      CHECK(d <= error);
      off = std::max(off, d);
      bound = std::max(bound, error);
    }
    CHECK(bound <= 20 * off);
  }
}

TEST_CASE("smooth motions by every formulation on IDAS: no algebraic unknown runs away", "[idas]") {
  // Accelerations and multipliers are in no norm of IDAS. Where Newton's corrections left a part of their error, it
  // grew from step to step by extrapolation, in some 7 of 40 tolerances, until rounding of it froze the velocities: psi
  // off by 2e-3 at rtol 1e-9 without a word.
  for (const char* formulation : {"index1", "index2", "index3", "baumgarte"})
    for (int k = 0; k < 20; ++k) {
      Problem p = make_problem(Scene::parse(flight("0.3*sin(P.x)", "", false), "flight.toml"));
      p.formulation = formulation;
      p.solver.integrator = "idas";
      p.solver.t_end = 100;
      p.solver.rtol = 1e-10 * std::pow(10, 0.2 * k);
      CAPTURE(formulation, p.solver.rtol);
      const Simulation run = simulate(p, p.parameters.values());
      CHECK(std::abs(run.psi - (kVy + 0.3 * (1 - std::cos(100.0)))) <=
            p.solver.rtol * static_cast<double>(run.counters.steps));
    }
}

TEST_CASE("a derivative on IDAS where the motion is at rest or a polynomial: the order it needs", "[idas]") {
  // The ball stops at its first touch and rolls: the states have no error at any order. 318,667 steps, and -3.622453.
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bouncing_ball/thrown.toml"), {"slope"});
  p.formulation = "index1";
  p.solver.rtol = 1e-10;
  const auto rho = p.parameters.values();
  const double oracle = gradient(p, "cvodes-adjoint", rho).gradient[0];
  const GradientResult r = gradient(p, "idas-forward", rho);
  CHECK(r.counters.steps < 1000);
  CHECK(std::abs(r.gradient[0] - oracle) <= 1e-10 * static_cast<double>(r.counters.steps) * std::abs(oracle));
}

TEST_CASE("brief forces: a damper that acts at some rates alone", "[touch]") {
  // A fall at 1 m/s^2 ends at the rate at which the damper carries the weight, 2 mm/s into a tent of 10 N: with a law
  // of lines, and another of many knots.
  std::string knots = "-50.0", forces = "0";
  for (int k = 0; k <= 40; ++k) {
    knots += fmt::format(", {:.17g}", 6.08 + 0.001 * k);
    forces += fmt::format(", {:.17g}", k <= 20 ? 0.5 * k : 20 - 0.5 * k);
  }
  for (const std::string& law : {std::string("x = [-50.0, 6.08, 6.1, 6.12, 50.0], y = [0, 0, 10, 0, 0]"),
                                 fmt::format("x = [{}, 50.0], y = [{}, 0]", knots, forces)})
    for (const auto& [formulation, integrator] : {std::pair{"baumgarte", "idas"},
                                                  {"index2", "idas"},
                                                  {"maggi", "cvodes"},
                                                  {"maggi", "dopri5"},
                                                  {"index1", "dop853"},
                                                  {"baumgarte", "radau5"}}) {
      CAPTURE(law, formulation, integrator);
      Problem p = make_problem(Scene::parse(fmt::format(R"([gravity]
y_m_per_s2 = -1
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0
y_m = -1
[mass.bob]
point = "P"
mass_kg = 1
[spring.d]
from = "A"
to = "P"
damper_law = {{ kind = "data", {}, between = "lines" }}
[start]
given = ["P.x", "P.y"]
[[cost.terminal]]
kind = "value"
output = "P.y_dot"
[run]
t_end_s = 10
rtol = 1e-8
)",
                                                        law),
                                            "fall.toml"));
      p.formulation = formulation;
      p.solver.integrator = integrator;
      const Simulation run = simulate(p, p.parameters.values());
      CHECK(std::abs(run.psi + 6.082) <= 1e-8 * static_cast<double>(run.counters.steps) * 6.082);
      CHECK(run.counters.steps < 1500);
    }
}

TEST_CASE("brief forces: an output that ends the run is beyond its level for an instant", "[touch][free_end]") {
  // Of two bells the first one ends the run, at X = at - w sqrt(log 2), however short it is.
  for (const auto& [formulation, integrator] :
       {std::pair{"baumgarte", "idas"}, {"maggi", "cvodes"}, {"maggi", "dopri5"}, {"baumgarte", "radau5"}})
    for (const double w : {0.5, 0.05, 0.002}) {
      CAPTURE(formulation, integrator, w);
      Problem p = make_problem(
          Scene::parse(fmt::format("{}[output.near]\nunit = \"1\"\n"
                                   "formula = \"exp(-((P.x - 4.1)/{:.17g})^2) + exp(-((P.x - 8)/0.5)^2)\"\n",
                                   flight("0", "", false), w),
                       "flight.toml", {"run.ends_when={output='near', above=0.5}", "cost.terminal[0].output=P.x"}));
      p.formulation = formulation;
      p.solver.integrator = integrator;
      p.solver.rtol = 1e-8;
      const Simulation run = simulate(p, p.parameters.values());
      CHECK(run.psi == Approx(4.1 - w * std::sqrt(std::log(2.0))).epsilon(1e-7));
    }
}
