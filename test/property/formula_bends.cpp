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

// The integral of max(x - b, 0) over a free flight: v (T - b/v)^2/2.
TEST_CASE("formula bends: a running cost that bends, against its closed form") {
  const Scene scene = Scene::parse(flight(R"toml([output.beyond]
formula = "max(P.x - b, 0)"
unit = "m"
b = 0.5
[[cost.running]]
kind = "value"
output = "beyond"
)toml",
                                          1),
                                   "beyond.toml");
  check(scene, {"output.beyond.b", "point.P.vx_m_per_s"}, [](const long double* p) {
    const long double s = 1 - p[0] / p[1];
    return p[1] * s * s / 2;
  });
}

TEST_CASE("formula bends: mistakes have their place") {
  const auto with = [](const std::string& formula) { return [=] { Scene::parse(wall(formula, 1), "wall.toml"); }; };
  CHECK_THROWS_WITH(with("k*max(P.x - a)")(), Contains("wall.toml:10") && Contains("'max' needs two arguments"));
  CHECK_THROWS_WITH(with("k*abs(P.x, a)")(), Contains("wall.toml:10") && Contains("a ')' is missing"));
  CHECK_THROWS_WITH(with("k*min*a")(), Contains("wall.toml:10") && Contains("in parentheses"));
}
