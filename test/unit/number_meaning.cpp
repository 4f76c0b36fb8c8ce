// A number means the same as a parameter and in a file: where a scene is read again with another value of one number,
// it holds the equations, the start values and the numbers that the mechanism has with that value as a parameter. Then
// gradients, --set and optimized.toml agree. Every number that may vary, of every kind's example and of the models.
#include <fmt/format.h>
#include <support/compare.h>
#include <support/random.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cctype>
#include <optional>
#include <set>

#include "costate/assembly/assembly.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;

namespace {

constexpr double kRounding = 1e-11;  // of a row's largest entry: the same formulas on the same numbers

/// The numbers that the equations and the start hold; others are first guesses.
std::set<int> used_numbers(const Mechanism& m) {
  std::set<int> r;
  const auto collect = [&](const auto& list) {
    for (const auto& e : list) r.insert(e->numbers().begin(), e->numbers().end());
  };
  collect(m.bodies());
  collect(m.constraints());
  collect(m.forces());
  for (const auto* given : {&m.given_positions(), &m.given_velocities()})
    for (const auto& g : *given) r.insert(g.number);
  return r;
}

/// All terms of the equations of motion at one state near the first positions.
Eigen::VectorXd equations(Assembly& assembly, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                          const Eigen::VectorXd& z) {
  StateView s;
  s.t = 0.3;
  s.q = q.data();
  s.v = v.data();
  s.z = z.data();
  assembly.calc_dynamics(s);
  std::vector<double> all;
  for (const auto* x :
       {&assembly.M, &assembly.phi_q, &assembly.Q, &assembly.phi, &assembly.phi_t, &assembly.bias, &assembly.zdot})
    all.insert(all.end(), x->begin(), x->end());
  return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

/// Of "tyre.front_left.magic_formula.PKY1" "tyre.magic_formula.PKY1": what numbers of one kind have in common.
std::string sort_of(const std::string& path) {
  const auto first = path.find('.'), second = path.find('.', first + 1);
  std::string r = second == std::string::npos ? path : path.substr(0, first) + path.substr(second);
  r.erase(std::remove_if(r.begin(), r.end(), [](unsigned char c) { return std::isdigit(c); }), r.end());
  return r;
}

int check_numbers(const Scene& scene, bool one_of_a_sort) {
  const Mechanism& m = *scene.mechanism();
  Random random(7);
  Eigen::VectorXd q = 0.05 * random.vector(m.coordinate_count()), v = random.vector(m.coordinate_count()),
                  z = 0.1 * random.vector(m.state_count());
  for (int i = 0; i < m.coordinate_count(); ++i)
    q[i] += m.numbers()[static_cast<std::size_t>(m.coordinates()[static_cast<std::size_t>(i)].position_number)].value;
  const std::set<int> used = used_numbers(m);
  std::set<std::string> seen;
  int checked = 0;
  for (const Number& n : m.numbers()) {
    if (!n.fixed_because.empty() || (one_of_a_sort && !seen.insert(sort_of(n.path)).second)) continue;
    INFO(n.path << " = " << n.value);
    std::optional<Scene> again;
    double x = 0;
    std::string why;
    for (const double step : {1e-5, -1e-5}) {  // one of them may break a rule, such as static >= dynamic friction
      // A zero moves by little, so that a slender bar keeps an inertia tensor that a body can have.
      x = n.value != 0 ? n.value + step * std::abs(n.value) : 0.1 * step;
      try {
        if (!again) again = scene.with_number(n.path, x);
        break;
      } catch (const Error& e) {
        why = e.what();
      }
    }
    // Numbers that one parameter of the scene ties together are refused one by one.
    if (!again && why.find("Numbers of one parameter must agree") != std::string::npos) continue;
    INFO("refused: " << why);
    REQUIRE(again);
    REQUIRE(again->mechanism()->numbers().size() == m.numbers().size());
    const ParameterSelection selection = m.select({n.path});
    std::vector<double> numbers = m.base_numbers();
    selection.apply(&x, numbers);
    for (const int k : used) {
      const Number& other = again->mechanism()->numbers()[static_cast<std::size_t>(k)];
      const double expected = numbers[static_cast<std::size_t>(k)];
      INFO("read again, " << other.path << " = " << other.value << ", with the parameter " << expected);
      REQUIRE(std::abs(other.value - expected) <= kRounding * std::max(std::abs(expected), std::abs(other.value)));
    }
    ++checked;
    // Where a zero component of a direction grows, another pair may span the rows across it: the same constraints.
    const bool direction = n.path.find(".axis") != std::string::npos || n.path.find(".normal") != std::string::npos;
    if (n.value == 0 && direction) continue;
    Assembly as_parameter(scene.mechanism(), selection), in_file(again->mechanism(), ParameterSelection{});
    as_parameter.set_parameters(&x);
    CHECK_BELOW(mismatch_by_rows(equations(as_parameter, q, v, z).transpose(), equations(in_file, q, v, z).transpose()),
                kRounding);
  }
  return checked;
}

}  // namespace

TEST_CASE("a number means the same as a parameter and in a file: every kind's example") {
  for (const SceneKind& kind : scene_kinds()) {
    INFO("example of [" << kind.name << ".NAME]");
    check_numbers(Scene::parse(kind.example, kind.name), false);
  }
}

TEST_CASE("a number means the same as a parameter and in a file: the models") {
  for (const char* name : {"andrews/andrews", "bricard/bricard", "car_axis/car_axis", "five_bar/five_bar",
                           "flyball_governor/flyball_governor", "golden_car/golden_car", "heavy_top/heavy_top",
                           "heavy_top/heavy_top_natural", "n_four_bar/n_four_bar_2", "pendulum/pendulum",
                           "slider_crank/slider_crank", "iltis/steer_ramp_20"}) {
    INFO(name);
    CHECK(check_numbers(Scene::load(fmt::format("{}/{}.toml", COSTATE_MODELS_DIR, name)), true) > 3);
  }
}

TEST_CASE("what a left-out number is taken from cannot vary until the scene writes it") {
  const auto scene = [](const std::string& length) {
    return Scene::parse(R"(
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[bar.rod]
from = "A"
to = "P"
mass_kg = 1
)" + length + R"(
[angle.turn]
bar = "rod"
[start]
given = ["P.x"]
)",
                        "rod.toml");
  };
  const Scene taken = scene("");
  CHECK_THROWS_WITH(
      taken.mechanism()->select({"point.A.x_m"}),
      Catch::Contains("'point.A.x_m' cannot vary") && Catch::Contains("write bar.rod.length_m = 1 to hold"));
  CHECK_NOTHROW(taken.mechanism()->select({"bar.rod.length_m"}));
  // The angle is a first guess here, which the start solves for.
  CHECK_NOTHROW(scene("length_m = 1").mechanism()->select({"point.A.x_m"}));
}
