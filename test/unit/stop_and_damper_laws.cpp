// Laws of vehicles' springs and dampers: polynomials on intervals, stops, scaled laws.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/kind/law/bump_stop_law.h"
#include "costate/kind/law/piecewise_law.h"
#include "costate/kind/law/scaled_law.h"
#include "costate/scene/scene.h"

using namespace costate;
using Catch::Matchers::Contains;

namespace {

std::vector<double> values(const LawOptions& o) {
  std::vector<double> p;
  for (const auto& [key, value] : o.numbers) p.push_back(value);
  return p;
}
double value(const LawOptions& o, double x) { return o.law->value(x, values(o).data()); }
Taylor2 curve(const LawOptions& o, double x) { return o.law->curve(x, values(o).data()); }
double integral(const LawOptions& o, double x) { return o.law->integral(x, values(o).data()); }

/// The damper of the Bombardier Iltis benchmark (Kortuem, Sharp and de Pater, Vehicle System Dynamics 22,
/// supplement 1993).
LawOptions iltis_damper() {
  return piecewise_law({-0.2, 0.21},
                       {{-416.42, 1844.3}, {0, 9945.627, 33955.72, -59832.25, -395651}, {1919.1638, 1634.727}},
                       Joins::slope);
}

Approx rounded(double x) { return Approx(x).epsilon(1e-13).margin(1e-13); }

}  // namespace

TEST_CASE("piecewise law: each interval has its own polynomial, exactly", "[law]") {
  const LawOptions damper = iltis_damper();
  for (const double x : {-1.0, -0.2000001}) CHECK(value(damper, x) == rounded(-416.42 + 1844.3 * x));
  for (const double x : {-0.2, -0.1, 0.0, 0.05, 0.2099999})
    CHECK(value(damper, x) ==
          rounded(9945.627 * x + 33955.72 * x * x - 59832.25 * std::pow(x, 3) - 395651 * std::pow(x, 4)));
  for (const double x : {0.21, 0.5, 2.0}) CHECK(value(damper, x) == rounded(1919.1638 + 1634.727 * x));
  CHECK(curve(damper, 0.0).c1 == rounded(9945.627));
  CHECK(curve(damper, 0.0).c2 == rounded(2 * 33955.72));
  CHECK(curve(damper, -3.0).c1 == rounded(1844.3));
  CHECK(curve(damper, -3.0).c2 == 0);
  REQUIRE(damper.numbers.size() == 11);
  CHECK(damper.numbers[3].first == "coefficients[1][1]");
  CHECK(damper.numbers[3].second == 9945.627);
}

TEST_CASE("piecewise law: stored energy piece by piece", "[law]") {
  // 1 + x left of -1, 0 up to 2, (x - 2)^2 = 4 - 4 x + x^2 beyond: integrals from 0 by hand.
  const LawOptions law = piecewise_law({-1, 2}, {{1, 1}, {0}, {4, -4, 1}}, Joins::value);
  CHECK(integral(law, 1.5) == 0);
  CHECK(integral(law, 3) == rounded(1.0 / 3));
  CHECK(integral(law, 5) == rounded(9));
  CHECK(integral(law, -3) == rounded(2));  // the integral of 1 + x from -1 to -3
  CHECK(integral(law, -1) == rounded(0));
  // 0 not in the middle piece.
  const LawOptions right = piecewise_law({1, 2}, {{3}, {2, 1}, {4}});
  CHECK(integral(right, 4) == rounded(3 + 3.5 + 8));
}

TEST_CASE("piecewise law: continued pieces begin where the one before ends", "[law]") {
  // 1 + x up to 0.5, then 1.5 + 2 (x - 0.5) - (x - 0.5)^2 up to 1.5, then 2.5: by hand.
  const LawOptions law = continued_law({0.5, 1.5}, {{1, 1}, {2, -1}, {0}});
  CHECK(value(law, -1) == rounded(0));
  CHECK(value(law, 1) == rounded(2.25));
  CHECK(value(law, 7) == rounded(2.5));
  CHECK(curve(law, 1).c1 == rounded(1));
  CHECK(curve(law, 1).c2 == rounded(-2));
  CHECK(integral(law, 0.5) == rounded(0.625));
  CHECK(integral(law, 1.5) == rounded(0.625 + 1.5 + 1 - 1.0 / 3));
  CHECK(integral(law, 2.5) == rounded(0.625 + 1.5 + 1 - 1.0 / 3 + 2.5));
  CHECK(integral(law, -2) == rounded(0));  // of 1 + x from -2 to 0
  REQUIRE(law.numbers.size() == 7);
  CHECK(law.numbers[5].first == "breaks[0]");
  // Its places move with the breaks: a kink at the first, at the second a jump of the curvature alone (slope 2 - 2).
  std::vector<double> p = values(law), kinks, bends, slopes(7, 0);
  law.law->add_kinks(p.data(), kinks);
  law.law->add_curvature_jumps(p.data(), bends);
  CHECK(kinks == std::vector<double>{0.5});
  CHECK(bends == std::vector<double>{1.5});
  law.law->add_place_slopes(1.5, p.data(), slopes.data());
  CHECK(slopes == std::vector<double>{0, 0, 0, 0, 0, 0, 1});
  p[5] = 0.75;  // the first break alone moves: 1.75 there
  CHECK(law.law->value(9, p.data()) == rounded(1.75 + 1.5 - 0.5625));
  CHECK_THROWS_WITH(continued_law({1}, {{1}, {}}), Contains("a piece without slope is [0]"));
}

TEST_CASE("piecewise law: what does not fit is refused", "[law]") {
  CHECK_THROWS_WITH(piecewise_law({}, {{1}}), Contains("'breaks' is empty"));
  CHECK_THROWS_WITH(piecewise_law({1, 1}, {{1}, {1}, {1}}), Contains("must increase: entry 2 is 1 after 1"));
  CHECK_THROWS_WITH(piecewise_law({1}, {{1}}), Contains("2 for 1 break; found 1"));
  CHECK_THROWS_WITH(piecewise_law({1}, {{1}, {}}), Contains("'coefficients[1]' is empty"));
  CHECK_THROWS_WITH(piecewise_law({1}, {{1, 1}, {3}}),
                    Contains("do not meet at the break x = 1: the value is 2 on its left and 3 on its right"));
  CHECK_NOTHROW(piecewise_law({1}, {{1, 1}, {3}}, Joins::none));
  CHECK_THROWS_WITH(piecewise_law({1}, {{1, 1}, {2}}, Joins::slope), Contains("the slope is 1 on its left and 0"));
  CHECK_NOTHROW(piecewise_law({1}, {{1, 1}, {2}}));
}

TEST_CASE("bump stop: nothing before the gap, a power beyond", "[law]") {
  const LawOptions stop = bump_stop_law(0.006, 1e7, 1, 1e-3);
  for (const double x : {1.0, 0.01, 0.00651}) CHECK(value(stop, x) == 0);
  for (const double x : {0.0055, 0.005, -0.1}) CHECK(value(stop, x) == Approx(-1e7 * (0.006 - x)).epsilon(1e-12));
  CHECK(value(stop, 0.006) == Approx(-1e7 * 3e-3 / 32).epsilon(1e-12));  // the most that smoothing adds
  // Twice continuously differentiable at both ends of the smoothed part: there the ramp's third derivative is
  // at most 6/w^2 in depth, so that curvatures 2e-9 apart differ by k 6/w^2 2e-9 = 1.2e5.
  for (const double x : {0.0055, 0.0065}) {
    const Taylor2 a = curve(stop, x - 1e-9), b = curve(stop, x + 1e-9);
    CHECK(a.c0 == Approx(b.c0).margin(1e7 * 2.1e-9));
    CHECK(a.c1 == Approx(b.c1).margin(1));
    CHECK(a.c2 == Approx(b.c2).margin(1.3e5));
  }
  const LawOptions power = bump_stop_law(-0.1, 3e4, 2.5, 0);
  CHECK(value(power, -0.35) == Approx(-3e4 * std::pow(0.25, 2.5)).epsilon(1e-13));
  CHECK(curve(power, -0.35).c1 == Approx(3e4 * 2.5 * std::pow(0.25, 1.5)).epsilon(1e-13));
  CHECK(value(power, -0.1) == 0);
  CHECK(integral(power, -0.35) == Approx(3e4 * std::pow(0.25, 3.5) / 3.5).epsilon(1e-13));
  const LawOptions rebound = bump_stop_law(0.2, 3e4, 2, 0, StopSide::above);
  CHECK(value(rebound, 0.1) == 0);
  CHECK(value(rebound, 0.3) == Approx(3e4 * 0.01).epsilon(1e-13));
}

TEST_CASE("bump stop: what does not fit is refused", "[law]") {
  CHECK_THROWS_WITH(bump_stop_law(0, 1e4, 1, 0), Contains("give a width 'smoothing'"));
  CHECK_THROWS_WITH(bump_stop_law(0, 1e4, 0.5, 0), Contains("'exponent' must be 1 or more, found 0.5"));
  CHECK_THROWS_WITH(bump_stop_law(0, -1, 1, 1), Contains("'stiffness' must not be negative"));
  CHECK_THROWS_WITH(bump_stop_law(0, 1, 1, -1), Contains("'smoothing' must not be negative"));
}

TEST_CASE("scaled law: about a reference point and as a whole", "[law]") {
  const LawOptions strut = polynomial_law({-4.0092e6, 2.8397e7, -6.7061e7, 5.2796e7});
  const auto f = [](double z) { return -4.0092e6 + z * (2.8397e7 + z * (-6.7061e7 + z * 5.2796e7)); };
  const LawOptions stiffer = scaled_law(30000, 24529, strut, 0.35);
  for (const double z : {0.3, 0.35, 0.41})
    CHECK(value(stiffer, z) == Approx(f(0.35) + 30000.0 / 24529 * (f(z) - f(0.35))).epsilon(1e-12).margin(1e-8));
  CHECK(value(stiffer, 0.35) == value(strut, 0.35));
  const LawOptions whole = scaled_law(3 * 9945.627, 9945.627, iltis_damper());
  for (const double x : {-0.4, 0.1, 0.3}) CHECK(value(whole, x) == rounded(3 * value(iltis_damper(), x)));
  CHECK(curve(whole, 0).c1 == rounded(3 * 9945.627));
  // Unscaled it is the law itself, to the last bit where the reference is 0 with no force.
  const LawOptions same = scaled_law(9945.627, 9945.627, iltis_damper(), 0);
  for (const double x : {-0.4, 0.1, 0.3}) CHECK(value(same, x) == value(iltis_damper(), x));
  CHECK(same.numbers[3].first == "law.coefficients[0][0]");
  CHECK_THROWS_WITH(scaled_law(1, 0, strut), Contains("'nominal_slope' must not be 0"));
}

TEST_CASE("laws of a scene: nested, with numbers as parameters, and mistakes with their place", "[law]") {
  const std::string bodies = R"(
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.5
y_m = 0
[mass.bob]
point = "P"
mass_kg = 1
[start]
given = ["P.x", "P.y"]
[spring.strut]
from = "A"
to = "P"
natural_length_m = 0
spring_law = { kind = "polynomial", coefficients = [-10, 30] }
)";
  const Scene scene = Scene::parse(bodies + R"(
damper_law = { kind = "scaled", slope = 9945.627, nominal_slope = 9945.627, reference = 0, law = { kind = "piecewise", breaks = [-0.2, 0.21], coefficients = [[-416.42, 1844.3], [0, 9945.627, 33955.72, -59832.25, -395651], [1919.1638, 1634.727]] } }
)",
                                   "strut.toml");
  for (const char* path : {"spring.strut.damper_law.slope", "spring.strut.damper_law.reference",
                           "spring.strut.damper_law.law.coefficients[1][4]", "spring.strut.spring_law.coefficients[1]"})
    CHECK_NOTHROW(scene.mechanism()->number(path));
  const Scene changed = scene.with_number("spring.strut.damper_law.law.coefficients[1][4]", -395652);
  const Mechanism& m = *changed.mechanism();
  CHECK(m.numbers()[m.number("spring.strut.damper_law.law.coefficients[1][4]")].value == -395652);

  const auto refused = [&](const std::string& law, const std::string& message) {
    CAPTURE(law);
    CHECK_THROWS_WITH(Scene::parse(bodies + "damper_law = " + law, "strut.toml"),
                      Contains("strut.toml:19:") && Contains(message));
  };
  refused("{ kind = \"piecewise\", breaks = [0], coefficients = [0, 1] }",
          "'coefficients[0]' in [spring.strut.damper_law] must be an array of numbers, found the number 0");
  refused("{ kind = \"piecewise\", breaks = [0], coefficients = [[0], [\"x\"]] }",
          "'coefficients[1][0]' in [spring.strut.damper_law] must be a number");
  refused("{ kind = \"piecewise\", breaks = [0], coefficients = [[0], [1]] }",
          "The pieces do not meet at the break x = 0");
  refused("{ kind = \"bump_stop\", gap = 0, stiffness = 1 }", "give a width 'smoothing'");
  refused("{ kind = \"scaled\", slope = 1, nominal_slope = 1 }", "'law'");
  refused("{ kind = \"scaled\", slope = 1, nominal_slope = 1, law = { kind = \"polynom\" } }", "must be one of ");
  refused("{ kind = \"bump_stop\", gap = 0, stiffness = 1, exponent = 2, smothing = 1 }", "Did you mean 'smoothing'?");
}
