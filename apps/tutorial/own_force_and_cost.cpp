// Tutorial 2: a force law and a cost of your own.
//
// A pendulum swings past a magnet and should keep away from an obstacle. Costate knows neither magnets nor obstacles:
// this file adds both, each in a few lines of physics. They then work as if they had always been there: in scene files,
// with their numbers as parameters, in every formulation and with every gradient method, exactly differentiated.
//
// Nothing has to be told that they exist. A library or program that contains such a file knows the new kinds.
//
// The program checks its own result and returns 1 when something is wrong.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/force/axial_force.h"
#include "costate/kind/lookup.h"
#include "costate/objective/objective.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/cost_kind.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"
#include "costate/sensitivity/method.h"

namespace {

using namespace costate;

// ---------------------------------------------------------------------------------------------------------------------
// 1. A force law: F = c / (x + gap)^2 pulls two points at a distance x together, on top of eddy currents that brake,
//    b xdot / (x + gap)^2.
//
// Only the law is ours. AxialForce<Law> knows the geometry of a force between two points, and differentiates the law by
// evaluating it on dual numbers, which is why it is a template: S is double or a dual number, P the type of the law's
// own numbers.
struct MagnetLaw {
  static constexpr int states = 0;  // a law may have states of its own, zdot = f(t, x, xdot, z, p): see MaxwellLaw

  /// p: strength c [N m^2], gap [m], braking b [N s m].
  template <class S, class P>
  void operator()(const S& /*t*/, const S& x, const S& rate, const S* /*z*/, const P* p, S& force, S* /*zdot*/) const {
    const S distance = x + S(p[1]);
    force = (S(p[0]) + S(p[2]) * rate) / (distance * distance);
  }
  /// Its integral, for energy balances [J]; what is not conservative has none.
  double potential_energy(double x, const double* p) const { return -p[0] / (x + p[1]); }
};

// Its place in scenes: a table [magnet.NAME]. table.number() registers a number of the mechanism under its path
// ("magnet.M.strength_N_m2"), checks its sign, and makes it one that can vary.
const RegisterSceneKind magnet({
    .name = "magnet",
    .summary = "attraction and eddy-current braking between two points",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string from = table.text("from"), to = table.text("to");
          const std::vector<int> numbers = {
              table.number("strength_N_m2", builder, NumberRule::non_negative),
              table.number("gap_m", builder, NumberRule::positive),
              table.number("braking_N_s_m", builder, NumberRule::non_negative, 0),  // 0 where the scene gives none
          };
          builder.add(std::make_unique<AxialForce<MagnetLaw>>("magnet", name, MagnetLaw(), numbers,
                                                              find_line(builder, table.path(), from, to)));
        },
});

// ---------------------------------------------------------------------------------------------------------------------
// 2. A cost: weight exp(-d^2 / radius^2), where d is the distance of a point from an obstacle.
//
// DualCostTerm differentiates physics() by all positions, velocities, accelerations, multipliers, force states and
// numbers that it may depend on.
class KeepAway final : public DualCostTerm<KeepAway> {
 public:
  /// `point`: index of the coordinate x of a free point; the others: indices of numbers.
  KeepAway(int point, int x, int y, int radius, int weight)
      : point_(point), x_(x), y_(y), radius_(radius), weight_(weight) {}

  template <class S>
  S physics(const CostArguments<S>& at) const {
    using std::exp;
    const S dx = at.q[point_] - at.numbers[x_], dy = at.q[point_ + 1] - at.numbers[y_];
    const S radius = at.numbers[radius_];
    return at.numbers[weight_] * exp(-(dx * dx + dy * dy) / (radius * radius));
  }
  bool needs_accelerations() const override { return false; }  // a promise that saves work

 private:
  int point_, x_, y_, radius_, weight_;
};

// Its place in scenes: kind = "keep_away" of [[cost.running]] or [[cost.terminal]]. It is read before the mechanism
// exists, and made when it does.
const RegisterCostKind keep_away({
    .name = "keep_away",
    .summary = "weight exp(-d^2 / radius^2) of a free point's distance d from an obstacle",
    .read = [](SceneTable& table, MechanismBuilder& builder) -> MakeCostTerm {
      const std::string point = table.text("point");
      const int x = table.number("x_m", builder), y = table.number("y_m", builder);
      const int radius = table.number("radius_m", builder, NumberRule::positive);
      const int weight = table.number("weight", builder, NumberRule::non_negative, 1);
      return [=](const Mechanism& mechanism) {
        return std::make_shared<KeepAway>(mechanism.coordinate(point + ".x"), x, y, radius, weight);
      };
    },
});

// ---------------------------------------------------------------------------------------------------------------------
// 3. A scene that uses them. It could as well be a file.
const char* const kScene = R"(
title = "Pendulum between a magnet and an obstacle"

[gravity]
y_m_per_s2 = -9.81

[point.pivot]
ground = true
x_m = 0
y_m = 0

[point.pole]
ground = true
x_m = 0.3
y_m = -1.2

[point.bob]
x_m = -0.8
y_m = -0.6

[bar.rod]
from = "pivot"
to = "bob"
mass_kg = 0.2

[mass.bob]
point = "bob"
mass_kg = 0.5

[magnet.M]
from = "pole"
to = "bob"
strength_N_m2 = 0.4
gap_m = 0.15
braking_N_s_m = 0.02

[start]
given = ["bob.x"]

[[cost.running]]
kind = "keep_away"
point = "bob"
x_m = 0.6
y_m = -0.7
radius_m = 0.4
weight = 2

[[cost.terminal]]
kind = "keep_away"
point = "bob"
x_m = 0
y_m = -0.9
radius_m = 0.5

[parameter.strength]
number = "magnet.M.strength_N_m2"

[parameter.braking]
number = "magnet.M.braking_N_s_m"

[parameter.obstacle]
number = "cost.running[0].x_m"

[run]
t_end_s = 3
rtol = 1e-10
parameters = ["strength", "braking", "obstacle", "magnet.M.gap_m", "bar.rod.length_m"]
)";

/// max_j |a_j - b_j| / |b_j|
double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double d = 0;
  for (std::size_t j = 0; j < a.size(); ++j) d = std::max(d, std::abs(a[j] - b[j]) / std::abs(b[j]));
  return d;
}

}  // namespace

int main() try {
  const Scene scene = Scene::parse(kScene, "own_force_and_cost.cpp");
  Problem problem = make_problem(scene);
  const std::vector<double> rho = problem.parameters.values();

  // Whole simulations at changed numbers: they know of no derivative.
  const GradientResult oracle = gradient(problem, "differences", rho);
  fmt::print("{}\npsi = {:.12g}\n", scene.title, oracle.psi);
  for (std::size_t j = 0; j < rho.size(); ++j)
    fmt::print("  d(psi)/d({}) = {:.10g}\n", problem.parameters.names()[j], oracle.gradient[j]);

  // Exact gradients, in every combination that there is.
  bool good = true;
  for (const std::string formulation : {"index1", "index2", "baumgarte", "penalty"})
    for (const std::string method : {"idas-forward", "idas-adjoint", "cvodes-forward", "cvodes-adjoint"}) {
      if (!refusal(find_sensitivity_method(method), find_formulation(formulation)).empty()) continue;
      problem.formulation = formulation;
      const double apart = distance(gradient(problem, method, rho).gradient, oracle.gradient);
      fmt::print("  {:<12} {:<16} {:.1e} from differences\n", formulation, method, apart);
      // Penalties stand for the constraints up to O(1 / alpha).
      good = good && apart < 1e-6;
    }

  // A mistake in a table of the new kind is reported like any other.
  try {
    Scene::parse(std::string(kScene) + "[magnet.N]\nfrom = \"pole\"\nto = \"bob\"\nstrength_N_m2 = -1\ngap_m = 1\n",
                 "own_force_and_cost.cpp");
    good = false;
  } catch (const SceneError& e) {
    fmt::print("A mistake: {}\n", e.what());
  }
  if (!good) fmt::print(stderr, "This is not what it should be.\n");
  return good ? 0 : 1;
} catch (const costate::Error& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 1;
}
