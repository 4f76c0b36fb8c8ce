// abs, min and max in formulas: forces and costs that bend where the motion passes a place, at an instant that moves
// with every parameter. Against closed forms, by every method; Hessians as well.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "hessian_compare.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

/// A mass that flies along x from 0.
std::string flight(const std::string& rest, double t_end) {
  return fmt::format(R"toml([point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1.3
[mass.bob]
point = "P"
mass_kg = 1.5
{}
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = {}
rtol = 1e-10
)toml",
                     rest, t_end);
}

std::string wall(const std::string& formula, double t_end) {
  return flight("[force.wall]\npoint = \"P\"\nformula_x_N = \"" + formula + R"("
k = 40
a = 0.6
[[cost.terminal]]
kind = "square"
output = "P.x"
target = 2
)",
                t_end);
}
/// The same by a table of two lines.
const char* const kRamp = "ramp = { kind = \"data\", x = [-5, 0, 5], y = [0, 0, -5], between = \"lines\" }\n";
std::string table_wall(const std::string& formula, double t_end, const std::string& table = kRamp) {
  std::string text = wall(formula, t_end);
  return text.insert(text.find("[[cost"), table);
}
const std::vector<std::string> kWall = {"force.wall.k", "force.wall.a", "mass.bob.mass_kg", "point.P.vx_m_per_s"};

/// Free until a/v, a half of a sine while the wall is pressed, free again.
auto closed_form(long double T) {
  return [T](const long double* p) {
    const long double k = p[0], a = p[1], m = p[2], v = p[3], w = std::sqrt(k / m), s = T - a / v,
                      pi = std::acos(-1.0L);
    const long double x = s < 0 ? v * T : w * s < pi ? a + v / w * std::sin(w * s) : a - v * (s - pi / w);
    return (x - 2) * (x - 2);
  };
}
template <class Psi>
std::vector<double> slopes(const Psi& psi, const std::vector<double>& rho) {
  std::vector<double> g;
  for (std::size_t j = 0; j < rho.size(); ++j) {
    std::vector<long double> p(rho.begin(), rho.end());
    const long double h = 1e-4L * p[j];
    const auto at = [&](int n) {
      p[j] = static_cast<long double>(rho[j]) + n * h;
      return psi(p.data());
    };
    g.push_back(static_cast<double>((at(-2) - 8 * at(-1) + 8 * at(1) - at(2)) / (12 * h)));
  }
  return g;
}

/// By every method with an error control, to what the tolerances of a thousand steps leave.
template <class Psi>
void check(const Scene& scene, const std::vector<std::string>& parameters, const Psi& psi) {
  for (const char* formulation : {"index1", "baumgarte", "maggi", "index3"})
    for (const SensitivityMethod& method : sensitivity_methods()) {
      Problem p = make_problem(scene, parameters);
      p.formulation = formulation;
      if (!refusal(method, find_formulation(formulation)).empty() || by_fixed_steps(p, method) || method.perturbs)
        continue;
      INFO(formulation << " x " << method.name);
      const auto rho = p.parameters.values();
      const std::vector<long double> at(rho.begin(), rho.end());
      const auto right = slopes(psi, rho);
      const GradientResult r = gradient(p, method.name, rho);
      CHECK(std::abs(r.psi - static_cast<double>(psi(at.data()))) <= 1e-7);
      double size = 0;
      for (std::size_t j = 0; j < rho.size(); ++j) size = std::max(size, std::abs(right[j] * rho[j]));
      for (std::size_t j = 0; j < rho.size(); ++j)
        CHECK(std::abs(r.gradient[j] - right[j]) * std::abs(rho[j]) <= 1e-6 * size);
    }
}

}  // namespace

TEST_CASE("formula bends: a wall of a formula, against its closed form") {
  // Pressed at 0.6 s, and left behind at 1.2 s.
  for (const double T : {0.6, 1.2}) {
    CAPTURE(T);
    for (const char* formula : {"-k*max(P.x - a, 0)", "min(0, k*(a - P.x), 1e9)"})
      check(Scene::parse(wall(formula, T), "wall.toml"), kWall, closed_form(T));
  }
  check(Scene::parse(wall("-0.5*k*(P.x - a + abs(P.x - a))", 1.2), "wall.toml"), kWall, closed_form(1.2));
}

TEST_CASE("formula bends: the Hessian over a wall of a formula, against its closed form") {
  for (const double T : {0.6, 1.2}) {
    CAPTURE(T);
    Problem p = make_problem(Scene::parse(wall("-k*max(P.x - a, 0)", T), "wall.toml"), kWall);
    p.formulation = "baumgarte";
    const auto rho = p.parameters.values();
    const auto right = hessian_of(closed_form(T), rho, {4e-2L, 6e-4L, 1.5e-3L, 1.3e-3L});
    CHECK(apart(p, hessian(p, rho).matrix, right) <= 1e-5);
  }
}

TEST_CASE("formula bends: a wall by a table in a formula, against its closed form") {
  for (const double T : {0.6, 1.2}) {
    CAPTURE(T);
    check(Scene::parse(table_wall("k*ramp(P.x - a)", T), "wall.toml"), kWall, closed_form(T));
    Problem p = make_problem(Scene::parse(table_wall("k*ramp(P.x - a)", T), "wall.toml"), kWall);
    p.formulation = "baumgarte";
    const auto rho = p.parameters.values();
    const auto right = hessian_of(closed_form(T), rho, {4e-2L, 6e-4L, 1.5e-3L, 1.3e-3L});
    CHECK(apart(p, hessian(p, rho).matrix, right) <= 1e-5);
  }
  // The table's own number in the place of k: the same steps, the same numbers.
  auto parameters = kWall;
  parameters[0] = "force.wall.ramp.scale";
  const std::string scaled =
      "ramp = { kind = \"data\", x = [-5, 0, 5], y = [0, 0, -5], between = \"lines\", scale = 40 }\n";
  const Scene table = Scene::parse(table_wall("ramp(P.x - a)*k/40", 1.2, scaled), "table.toml"),
              max = Scene::parse(wall("-40*max(P.x - a, 0)*k/40", 1.2), "max.toml");
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "cvodes-adjoint"},
                                            {"maggi", "hand-adjoint"},
                                            {"index3", "hand-tangent"},
                                            {"index1", "idas-forward"}}) {
    INFO(formulation << " x " << method);
    const auto of = [&, formulation = formulation, method = method](const Scene& scene,
                                                                    const std::vector<std::string>& names) {
      Problem p = make_problem(scene, names);
      p.formulation = formulation;
      return gradient(p, method, p.parameters.values()).gradient;
    };
    const auto x = of(table, parameters), y = of(max, kWall);
    for (std::size_t j = 0; j < y.size(); ++j) CHECK(x[j] == Approx(y[j]).epsilon(1e-10));
  }
}

// A spring's law through the same points acts as the formula of its deformation; the table's ordinates are parameters.
TEST_CASE("formula bends: a wall by a map, against its closed form") {
  // Along either argument; the other one moves across its own places, at which nothing bends.
  const std::string along_x =
                        "ramp = { kind = \"map\", x = [-5, 0, 5], y = [-1, 0.4, 9], z = [[0, 0, -5], [0, 0, -5], "
                        "[0, 0, -5]], between = \"lines\" }\n",
                    along_y =
                        "ramp = { kind = \"map\", x = [-1, 0.4, 9], y = [-5, 0, 5], z = [[0, 0, 0], [0, 0, 0], "
                        "[-5, -5, -5]], between = \"lines\" }\n";
  check(Scene::parse(table_wall("k*ramp(P.x - a, t)", 1.2, along_x), "wall.toml"), kWall, closed_form(1.2));
  check(Scene::parse(table_wall("k*ramp(P.x, P.x - a)", 1.2, along_y), "wall.toml"), kWall, closed_form(1.2));
  Problem p = make_problem(Scene::parse(table_wall("k*ramp(P.x - a, t)", 1.2, along_x), "wall.toml"), kWall);
  p.formulation = "baumgarte";
  const auto rho = p.parameters.values();
  const auto right = hessian_of(closed_form(1.2), rho, {4e-2L, 6e-4L, 1.5e-3L, 1.3e-3L});
  CHECK(apart(p, hessian(p, rho).matrix, right) <= 1e-5);
}

TEST_CASE("formula bends: a map of what is bilinear is its formula") {
  // 0.2 - 0.7 x + 0.3 v - 0.4 x v, by a spline that the motion leaves along its tangents.
  const std::string points = "drag = { kind = \"map\", x = [-0.1, 0.3, 0.5, 0.8], y = [-1, 0, 1.1], z = ";
  std::string rows = "[";
  for (const double v : {-1.0, 0.0, 1.1}) {
    rows += "[";
    for (const double x : {-0.1, 0.3, 0.5, 0.8})
      rows += fmt::format("{:.17g}, ", 0.2 - 0.7 * x + 0.3 * v - 0.4 * x * v);
    rows += "], ";
  }
  const Scene map = Scene::parse(
      table_wall("k*drag(P.x, P.x_dot)*a", 1.5, points + rows + "], beyond = \"tangent\", scale = 0.1 }\n"),
      "map.toml");
  const Scene formula =
      Scene::parse(wall("k*a*s*(0.2 - 0.7*P.x + 0.3*P.x_dot - 0.4*P.x*P.x_dot)\"\ns = 0.1\n# \"", 1.5), "formula.toml");
  auto by_map = kWall, by_formula = kWall;
  by_map.push_back("force.wall.drag.scale");
  by_formula.push_back("force.wall.s");
  for (const char* formulation : {"baumgarte", "index1", "maggi"})
    for (const SensitivityMethod& method : sensitivity_methods()) {
      Problem p = make_problem(map, by_map), q = make_problem(formula, by_formula);
      p.formulation = q.formulation = formulation;
      if (!refusal(method, find_formulation(formulation)).empty() || by_fixed_steps(p, method) || method.perturbs)
        continue;
      INFO(formulation << " x " << method.name);
      const GradientResult a = gradient(p, method.name, p.parameters.values()),
                           b = gradient(q, method.name, q.parameters.values());
      // The map's knots are places where steps end: at rtol 1e-10 other steps leave some 1e-8.
      CHECK(std::abs(a.psi - b.psi) <= 1e-7 * std::abs(b.psi));
      double size = 0;
      for (const double g : b.gradient) size = std::max(size, std::abs(g));
      for (std::size_t j = 0; j < b.gradient.size(); ++j) CHECK(std::abs(a.gradient[j] - b.gradient[j]) <= 1e-6 * size);
    }
}

TEST_CASE("formula bends: a map of measured rows, in any order, and its mistakes") {
  const auto scene = [](const std::string& rows, const std::string& map) {
    return "[data.wind]\ncolumns = [\"speed\", \"place [cm]\", \"cx\"]\ntimed = false\nrows = " + rows + "\n" +
           table_wall("k*a*0.1*g(P.x, P.x_dot)", 0.5, map);
  };
  const std::string measured =
      "g = { kind = \"map\", data = \"wind\", over = [\"place\", \"speed\"], column = \"cx\", "
      "between = \"lines\", beyond = \"tangent\" }\n";
  const auto run = [](const Scene& s) {
    Problem p = make_problem(s, kWall);
    return gradient(p, "cvodes-adjoint", p.parameters.values());
  };
  const auto a = run(Scene::parse(scene("[[1, 0, 2], [2, 50, 5], [2, 0, 3], [1, 50, 1]]", measured), "wall.toml"));
  const auto b = run(Scene::parse(
      table_wall("k*a*0.1*g(P.x, P.x_dot)", 0.5,
                 "g = { kind = \"map\", x = [0, 0.5], y = [1, 2], z = [[2, 1], [3, 5]], between = \"lines\", beyond = "
                 "\"tangent\" }\n"),
      "wall.toml"));
  CHECK(a.psi == b.psi);
  CHECK(a.gradient == b.gradient);
  const auto with = [&](const std::string& rows, const std::string& map) {
    return [=] { Scene::parse(scene(rows, map), "wall.toml"); };
  };
  CHECK_THROWS_WITH(with("[[1, 0, 2], [2, 50, 5], [2, 0, 3]]", measured)(),
                    Contains("wall.toml") && Contains("no value of 'cx' at place = 0.5, speed = 1"));
  CHECK_THROWS_WITH(with("[[1, 0, 2], [1, 0, 3], [2, 0, 3]]", measured)(), Contains("two values of 'cx' at place = 0"));
  CHECK_THROWS_WITH(with("[[1, 0, 2]]", "g = { kind = \"data\", data = \"wind\", column = \"cx\" }\n")(),
                    Contains("There is no time in data 'wind'"));
  const auto written = [](const std::string& formula, const std::string& map) {
    return [=] { Scene::parse(table_wall(formula, 1, map), "wall.toml"); };
  };
  const std::string g = "g = { kind = \"map\", x = [0, 1], y = [0, 1], z = [[0, 1], [1, 2]] }\n";
  CHECK_THROWS_WITH(written("k*a*g(P.x)", g)(), Contains("'g' is a map, of two arguments, with a ','"));
  CHECK_THROWS_WITH(written("k*a*g(P.x, t, t)", g)(), Contains("'g' is a map, of two arguments"));
  CHECK_THROWS_WITH(written("k*ramp(P.x, a)", kRamp)(), Contains("'ramp' is a law, of one argument"));
  CHECK_THROWS_WITH(written("k*a*P.x", g)(), Contains("'g' is in no formula"));
  CHECK_THROWS_WITH(written("k*a*g(P.x, t)", "g = { kind = \"map\", x = [0, 1], y = [0, 1], z = [[0, 1], [1]] }\n")(),
                    Contains("wall.toml:13") && Contains("row 2 holds 1"));
  CHECK_THROWS_WITH(
      written("k*a*g(P.x, t)", "g = { kind = \"map\", x = [0, 0], y = [0, 1], z = [[0, 1], [1, 2]] }\n")(),
      Contains("wall.toml:13") && Contains("along x must increase"));
  CHECK_THROWS_WITH(written("k*a*g(P.x, t)",
                            "g = { kind = \"map\", x = [0, 1], y = [0, 1], z = [[0, 1], [1, 2]], "
                            "extra = 1 }\n")(),
                    Contains("extra"));
  CHECK_THROWS_WITH(Scene::parse(flight("[force.push]\npoint = \"P\"\nx_N = { kind = \"map\" }\n", 1), "push.toml"),
                    Contains("push.toml:10") && Contains("which formulas alone have"));
  Problem p = make_problem(Scene::parse(table_wall("k*a*0 + g(P.x, t)", 2, g), "wall.toml"), kWall);
  CHECK_THROWS_WITH(gradient(p, "cvodes-adjoint", p.parameters.values()), Contains("along x from 0 to 1"));
}

TEST_CASE("formula bends: a spline in a formula acts as a spring's law of it") {
  const std::string law = "{ kind = \"table\", x = [-1, 0.2, 0.5, 1.1, 2.5], y = [-20, 3, 9, 14, 80] }";
  const std::string rest = R"toml([[cost.running]]
kind = "square"
output = "P.x_dot"
)toml";
  const Scene formula = Scene::parse(
      flight("[force.s]\npoint = \"P\"\nformula_x_N = \"-g(P.x + 1.5 - L)\"\nL = 1\ng = " + law + "\n" + rest, 1.5),
      "formula.toml");
  const Scene spring = Scene::parse(
      flight("[point.A]\nground = true\nx_m = -1.5\ny_m = 0\n[spring.s]\nfrom = \"A\"\nto = \"P\"\nnatural_length_m = "
             "1\nspring_law = " +
                 law + "\n" + rest,
             1.5),
      "spring.toml");
  const auto of = [&](const Scene& scene, const std::vector<std::string>& parameters) {
    Problem p = make_problem(scene, parameters);
    p.solver.rtol = 1e-11;
    return gradient(p, "cvodes-adjoint", p.parameters.values());
  };
  const GradientResult a = of(formula, {"force.s.g.y[1]", "force.s.g.y[3]", "force.s.L"}),
                       b = of(spring,
                              {"spring.s.spring_law.y[1]", "spring.s.spring_law.y[3]", "spring.s.natural_length_m"});
  CHECK(std::abs(a.psi - b.psi) <= 1e-9 * b.psi);
  for (std::size_t j = 0; j < 3; ++j) {
    CAPTURE(j);
    CHECK(std::abs(a.gradient[j] - b.gradient[j]) <= 1e-8 * std::abs(b.gradient[j]));
  }
}

// At rest until a table of the time acts for two thousandths of ten seconds: impulse 2 x 1e-3 N s.
TEST_CASE("formula bends: a short table of the time is met") {
  for (const char* formula : {"2*g(t)", "g(t + 0*P.y)*2"}) {
    CAPTURE(formula);
    const std::string text = flight(
        std::string("[force.blow]\npoint = \"P\"\nformula_x_N = \"") + formula +
            "\"\ng = { kind = \"data\", x = [0, 7, 7.001, 7.002, 10], y = [0, 0, 1, 0, 0], between = \"lines\" }\n"
            "[[cost.terminal]]\nkind = \"value\"\noutput = \"P.x_dot\"\n",
        10);
    Problem p = make_problem(Scene::parse(text, "blow.toml"), {"force.blow.g.scale"});
    for (const char* method : {"cvodes-adjoint", "idas-forward"}) {
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(r.psi == Approx(1.3 + 2e-3 / 1.5).epsilon(1e-8));
      CHECK(r.gradient[0] == Approx(2e-3 / 1.5).epsilon(1e-5));
    }
  }
}

// The integral of max(x - b, 0) over a free flight: v (T - b/v)^2/2.
TEST_CASE("formula bends: a running cost that bends, against its closed form") {
  std::string text = flight(R"toml([output.beyond]
formula = "max(P.x - b, 0)"
unit = "m"
b = 0.5
[[cost.running]]
kind = "value"
output = "beyond"
)toml",
                            1);
  const auto closed = [](const long double* p) {
    const long double s = 1 - p[0] / p[1];
    return p[1] * s * s / 2;
  };
  check(Scene::parse(text, "beyond.toml"), {"output.beyond.b", "point.P.vx_m_per_s"}, closed);
  const std::string by = "max(P.x - b, 0)";
  text.replace(text.find(by), by.size(), "-ramp(P.x - b)").insert(text.find("b = 0.5"), kRamp);
  check(Scene::parse(text, "table.toml"), {"output.beyond.b", "point.P.vx_m_per_s"}, closed);
}

TEST_CASE("formula bends: mistakes have their place") {
  const auto with = [](const std::string& formula) { return [=] { Scene::parse(wall(formula, 1), "wall.toml"); }; };
  CHECK_THROWS_WITH(with("k*max(P.x - a)")(), Contains("wall.toml:10") && Contains("'max' needs two arguments"));
  CHECK_THROWS_WITH(with("k*abs(P.x, a)")(), Contains("wall.toml:10") && Contains("a ')' is missing"));
  CHECK_THROWS_WITH(with("k*min*a")(), Contains("wall.toml:10") && Contains("in parentheses"));
  CHECK_THROWS_WITH(with("k*ramp(P.x - a)")(),
                    Contains("wall.toml:10") && Contains("no function 'ramp'") && Contains("ramp = { kind = \"data\""));
  const auto tables = [](const std::string& formula, const std::string& table) {
    return [=] { Scene::parse(table_wall(formula, 1, table), "wall.toml"); };
  };
  CHECK_THROWS_WITH(tables("k*rmp(P.x - a)", kRamp)(), Contains("wall.toml:10") && Contains("Did you mean 'ramp'?"));
  CHECK_THROWS_WITH(tables("k*ramp*a", kRamp)(), Contains("wall.toml:10") && Contains("in parentheses"));
  CHECK_THROWS_WITH(tables("k*(P.x - a)", kRamp)(), Contains("wall.toml:13") && Contains("'ramp' is in no formula"));
  CHECK_THROWS_WITH(tables("k*a*sin(t)", "sin = { kind = \"data\", x = [0, 1], y = [0, 1] }\n")(),
                    Contains("wall.toml:13") && Contains("'sin' is a function of every formula"));
  CHECK_THROWS_WITH(
      tables("k*a*g(t)", "g = { kind = \"piecewise\", breaks = [1], coefficients = [[0], [2]], joins = \"none\" }\n")(),
      Contains("wall.toml:13") && Contains("jumps from 0 to 2 at 1"));
  CHECK_THROWS_WITH(tables("k*a*g(t)", "g = { kind = \"data\", data = \"air\", column = \"cx\" }\n")(),
                    Contains("wall.toml:13") && Contains("no table of data 'air'"));
  // Beyond its points a table is asked for what it does not say.
  Problem p = make_problem(Scene::parse(table_wall("k*a*0 + ramp(9*P.x)", 2), "wall.toml"), kWall);
  CHECK_THROWS_WITH(gradient(p, "cvodes-adjoint", p.parameters.values()), Contains("goes from -5 to 5"));
}
