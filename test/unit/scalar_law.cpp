// Scalar laws: values, smoothness where pieces join, extrapolation, derivatives with respect to their numbers.
#include "costate/element/law/scalar_law.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/element/law/composed_law.h"
#include "costate/element/law/data_law.h"
#include "costate/element/law/formula_law.h"
#include "costate/element/law/spline_law.h"
#include "costate/kind/law/steps_laws.h"

using namespace costate;
using Catch::Matchers::Contains;

namespace {

struct LawCase {
  std::string name;
  std::shared_ptr<const ScalarLaw> law;
  std::vector<double> p;
  double from, to;  // where it is looked at
};

std::vector<std::shared_ptr<const ScalarLaw>> pair_of_laws() {
  return {std::make_shared<PolynomialLaw>(3), std::make_shared<SineLaw>()};
}

std::vector<LawCase> laws() {
  return {
      {"polynomial", std::make_shared<PolynomialLaw>(4), {0.3, -1.2, 0.7, 2.0}, -2, 2},
      {"sine", std::make_shared<SineLaw>(), {0.5, 1.5, 3.0, 0.2}, -2, 2},
      {"smooth step", std::make_shared<SmoothStepLaw>(), {-0.5, 1.2, 2.0, -1.0}, -1.5, 2.5},
      {"table",
       std::make_shared<SplineLaw>(std::vector<double>{-1, -0.3, 0.4, 1.5, 2}),
       {1.0, -0.5, 0.2, 2.0, 1.0},
       -2.5,
       3.5},
      {"formula",
       std::make_shared<FormulaLaw>("-a*sin(w*x)^2*exp(-x/3) + (x - 1)^3/(2 + cos(x)) - 2^(b*x) + sqrt(9 + x)*tanh(x)"
                                    " + atan(x) - log(7 + x) + tan(x/9) + 1.5e-1*pi",
                                    std::vector<std::string>{"a", "w", "b"}),
       {1.5, 2.0, 0.7},
       -2,
       2},
      {"sum",
       std::make_shared<ComposedLaw>(ComposedLaw::Operation::sum, pair_of_laws()),
       {0.3, -1.2, 0.7, 0.5, 1.5, 3.0, 0.2},
       -2,
       2},
      {"product",
       std::make_shared<ComposedLaw>(ComposedLaw::Operation::product, pair_of_laws()),
       {0.3, -1.2, 0.7, 0.5, 1.5, 3.0, 0.2},
       -2,
       2},
      {"steps", std::make_shared<StepsLaw>(2), {0.7, -0.5, 0.1, 1.0, -1.0, 2.0}, -1.5, 2.5},
      {"chirp", std::make_shared<ChirpLaw>(), {0.5, 1.5, -1.0, 1.0, 0.5, 3.0, 0.3}, -2, 2}};
}

/// Rounding of sums of terms of size 10.
Approx rounded(double x) { return Approx(x).epsilon(1e-13).margin(1e-13); }

}  // namespace

TEST_CASE("laws: the four ways to evaluate agree", "[law]") {
  for (const LawCase& c : laws()) {
    CAPTURE(c.name);
    REQUIRE(static_cast<int>(c.p.size()) == c.law->number_count());
    std::vector<PathDual> p(c.p.begin(), c.p.end());
    for (int i = 0; i <= 100; ++i) {
      const double x = c.from + (c.to - c.from) * (i + 0.37) / 101;
      CAPTURE(x);
      const double f = c.law->value(x, c.p.data());
      const Dual<1> slope = c.law->slope(x, c.p.data());
      const Taylor2 curve = c.law->curve(x, c.p.data());
      const PathDual path = c.law->value(PathDual(Taylor2(x, 1, 0)), p.data());
      CHECK(slope.v == rounded(f));
      CHECK(curve.c0 == rounded(f));
      CHECK(path.v.c0 == rounded(f));
      CHECK(slope.d[0] == rounded(curve.c1));
      CHECK(path.v.c1 == rounded(curve.c1));
      CHECK(path.v.c2 == rounded(curve.c2));
      // Central differences with h = 1e-5: truncation h^2 f''' = 1e-8 (f''' < 100), rounding eps / h = 1e-10; the
      // difference of slopes likewise.
      const double h = 1e-5;
      const double up = c.law->value(x + h, c.p.data()), down = c.law->value(x - h, c.p.data());
      CHECK(curve.c1 == Approx((up - down) / (2 * h)).margin(3e-8));
      const double slope_up = c.law->slope(x + h, c.p.data()).d[0], slope_down = c.law->slope(x - h, c.p.data()).d[0];
      CHECK(curve.c2 == Approx((slope_up - slope_down) / (2 * h)).margin(1e-3));
    }
  }
}

TEST_CASE("laws: derivatives with respect to numbers", "[law]") {
  for (const LawCase& c : laws()) {
    for (const double x : {c.from, 0.11, 0.9, c.to}) {
      CAPTURE(c.name, x);
      for (std::size_t k = 0; k < c.p.size(); ++k) {
        std::vector<PathDual> p(c.p.begin(), c.p.end());
        p[k].d[0] = Taylor2(1.0);
        const PathDual d = c.law->value(PathDual(Taylor2(x, 0.8, -0.5)), p.data());
        std::vector<PathDual> up(c.p.begin(), c.p.end()), down = up;
        const double h = 1e-5;  // truncation h^2, rounding eps / h: both about 1e-10 times derivatives below 100
        up[k] += PathDual(h);
        down[k] -= PathDual(h);
        const Taylor2 a = c.law->value(PathDual(Taylor2(x, 0.8, -0.5)), up.data()).v;
        const Taylor2 b = c.law->value(PathDual(Taylor2(x, 0.8, -0.5)), down.data()).v;
        CHECK(d.d[0].c0 == Approx((a.c0 - b.c0) / (2 * h)).margin(1e-7));
        CHECK(d.d[0].c1 == Approx((a.c1 - b.c1) / (2 * h)).margin(1e-7));
        CHECK(d.d[0].c2 == Approx((a.c2 - b.c2) / (2 * h)).margin(1e-6));
      }
    }
  }
}

TEST_CASE("laws: twice continuously differentiable where pieces join", "[law]") {
  const double tiny = 1e-9;
  const auto check_joint = [&](const LawCase& c, double x) {
    CAPTURE(c.name, x);
    const Taylor2 left = c.law->curve(x - tiny, c.p.data()), right = c.law->curve(x + tiny, c.p.data());
    // Over 2e-9 each changes by at most its derivative (below 1e3) times that.
    CHECK(left.c0 == Approx(right.c0).margin(3e-6));
    CHECK(left.c1 == Approx(right.c1).margin(3e-6));
    CHECK(left.c2 == Approx(right.c2).margin(3e-6));
  };
  for (const LawCase& c : laws()) {
    if (c.name == "smooth step")
      for (const double x : {-0.5, 1.2}) check_joint(c, x);
    if (c.name == "steps")
      for (const double x : {-0.5, 0.1, 0.2, 0.8}) check_joint(c, x);
    if (c.name == "table")
      for (const double x : {-1.0, -0.3, 0.4, 1.5, 2.0}) check_joint(c, x);
  }
}

TEST_CASE("laws: polynomial and sine", "[law]") {
  const PolynomialLaw cubic(4), constant(1), none(0);
  const double p[] = {1, -2, 3, 0.5};
  CHECK(cubic.value(2, p) == 1 - 4 + 12 + 4);
  CHECK(cubic.curve(2, p).c1 == -2 + 12 + 6);
  CHECK(cubic.curve(2, p).c2 == 6 + 6);
  CHECK(constant.value(17, p) == 1);
  CHECK(none.value(17, p) == 0);
  const double s[] = {1, 2, 3, 0.5};
  CHECK(SineLaw().value(0.4, s) == rounded(1 + 2 * std::sin(1.7)));
}

TEST_CASE("laws: smooth step", "[law]") {
  const SmoothStepLaw law;
  const double p[] = {1, 3, -2, 6};
  for (const double x : {-10.0, 0.0, 1.0}) CHECK(law.value(x, p) == -2);
  for (const double x : {3.0, 4.0, 1e6}) CHECK(law.value(x, p) == 6);
  CHECK(law.value(2, p) == rounded(2));
  CHECK(law.curve(2, p).c1 == rounded(8.0 / 2 * 1.875));  // steepest: 15/8 of the mean slope
  CHECK(law.curve(0.5, p).c1 == 0);
  CHECK(law.curve(3.5, p).c2 == 0);
  double last = -2;  // monotone
  for (double x = 1; x <= 3; x += 0.01) {
    CHECK(law.value(x, p) >= last);
    last = law.value(x, p);
  }
}

TEST_CASE("laws: table", "[law]") {
  const std::vector<double> x = {-1, -0.3, 0.4, 1.5, 2};
  const SplineLaw law(x);
  const double y[] = {1.0, -0.5, 0.2, 2.0, 1.0};
  for (std::size_t k = 0; k < x.size(); ++k) CHECK(law.value(x[k], y) == rounded(y[k]));
  // Natural ends, continued by straight lines.
  CHECK(law.curve(-1, y).c2 == rounded(0));
  CHECK(law.curve(2, y).c2 == rounded(0));
  for (const double end : {-1.0, 2.0}) {
    const double out = end < 0 ? -3 : 5;
    const Taylor2 at = law.curve(end, y), far = law.curve(end + out, y);
    CHECK(far.c0 == rounded(at.c0 + out * at.c1));
    CHECK(far.c1 == rounded(at.c1));
    CHECK(far.c2 == 0);
  }
  // A straight line is reproduced, with and without kinks in the spacing.
  const double line[] = {2 - 3, 2 - 0.9, 2 + 1.2, 2 + 4.5, 2 + 6};
  for (const double at : {-4.0, -0.7, 0.0, 1.1, 1.9, 7.0}) CHECK(law.value(at, line) == rounded(2 + 3 * at));
  // Natural spline through (0,0), (1,1), (2,0): second derivative -3 in the middle, 11/16 half way up.
  const SplineLaw hat({0, 1, 2});
  const double h[] = {0, 1, 0};
  CHECK(hat.curve(1, h).c2 == rounded(-3));
  CHECK(hat.value(0.5, h) == rounded(0.6875));
  // Two points: a straight line.
  const SplineLaw two({0, 2});
  const double t[] = {1, 5};
  for (const double at : {-1.0, 0.5, 3.0}) CHECK(two.value(at, t) == rounded(1 + 2 * at));
}

TEST_CASE("laws: a table's abscissae must make sense", "[law]") {
  CHECK_THROWS_WITH(SplineLaw({}), Contains("at least 2 points, found 0"));
  CHECK_THROWS_WITH(SplineLaw({1}), Contains("at least 2 points, found 1"));
  CHECK_THROWS_AS(SplineLaw({1}), ModelError);
  CHECK_THROWS_WITH(SplineLaw({0, 1, 1}), Contains("must increase") && Contains("entry 3"));
  CHECK_THROWS_WITH(SplineLaw({0, -1}), Contains("entry 2 is -1 after 0"));
  CHECK_THROWS(SplineLaw({0, std::numeric_limits<double>::quiet_NaN()}));
}

TEST_CASE("laws: stored energy is the integral from 0", "[law]") {
  const PolynomialLaw cubic(4);
  const double p[] = {1, -2, 3, 0.5};
  // Gauss-Legendre is exact for polynomials.
  for (const double x : {-1.5, 0.0, 2.0})
    CHECK(cubic.integral(x, p) == rounded(x - x * x + x * x * x + 0.125 * x * x * x * x));
  const double s[] = {0, 1, 1, 0};
  CHECK(SineLaw().integral(2, s) == rounded(1 - std::cos(2.0)));
}

TEST_CASE("laws: formulas mean what they say", "[law]") {
  const auto value = [](const std::string& text, double x = 0.7) {
    const double p[] = {3, 0.5};
    return FormulaLaw(text, {"a", "t_1"}).value(x, p);
  };
  CHECK(value("1 + 2*3") == 7);
  CHECK(value("8/4/2 - 1 - 1") == -1);
  CHECK(value("-2^2") == -4);  // as in mathematics: the power binds closer than the sign
  CHECK(value("2^3^2") == rounded(512));
  CHECK(value("2^-1") == rounded(0.5));
  CHECK(value("(-x)^3", 2) == -8);
  CHECK(value("--x + +x", 2) == 4);
  CHECK(value("a*t_1*t", 2) == 3);
  CHECK(value("1e-1*x", 2) == rounded(0.2));
  CHECK(value(" sin ( pi / 2 ) ") == rounded(1));
  CHECK(value("exp(log(x)) - sqrt(x^2) + atan(tan(x)) - tanh(x)") == rounded(0.7 - std::tanh(0.7)));
  // x^0 and x^1 have derivatives at 0, too.
  const double p[] = {3, 0.5};
  CHECK(FormulaLaw("x^0 + a*x^1", {"a", "t_1"}).curve(0, p).c1 == 3);
  // Whole powers hold for negative x and at zero, however large, and downwards.
  CHECK(value("x^18", -1.1) == Approx(std::pow(1.1, 18)).epsilon(1e-14));
  CHECK(value("x^2001", -1) == -1);
  CHECK(value("x^-3", -2) == -0.125);
  CHECK(value("x^-(3)", -2) == -0.125);
  CHECK(value("exp(-x^20)", 0) == 1);
  const auto slopes = FormulaLaw("x^20 - x^-2", {"a", "t_1"}).curve(-1.1, p);
  CHECK(slopes.c1 == Approx(20 * std::pow(-1.1, 19) + 2 * std::pow(-1.1, -3)).epsilon(1e-13));
  CHECK(slopes.c2 == Approx(380 * std::pow(1.1, 18) - 6 * std::pow(1.1, -4)).epsilon(1e-13));
}

// Values on both sides, and derivatives by differences, which are exact where a formula is linear.
TEST_CASE("laws: abs, min and max of a formula of several variables", "[law]") {
  std::vector<std::string> others;
  const FormulaLaw f("2*abs(y - 1) + max(y, 3*t, -y)*a - min(t, y)", {"a"}, others);
  REQUIRE(others == std::vector<std::string>{"y"});
  REQUIRE(f.may_bend());
  std::vector<double> bends;
  for (const double t : {-0.7, 0.3, 2.0})
    for (const double y : {-2.0, 0.4, 1.7}) {
      const double p[] = {5, y};
      CAPTURE(t, y);
      CHECK(f.value(t, p) == rounded(2 * std::abs(y - 1) + std::max({y, 3 * t, -y}) * 5 - std::min(t, y)));
      bends.clear();
      f.add_bends(t, p, bends);
      REQUIRE(bends.size() == 4);
      CHECK(bends[0] == rounded(y - 1));
      CHECK(bends[1] == rounded(y - 3 * t));
      CHECK(bends[2] == rounded(std::max(y, 3 * t) + y));
      CHECK(bends[3] == rounded(t - y));
      PathDual x[] = {PathDual(5), PathDual(y)};
      x[1].d[0] = Taylor2(1.0);
      const double h = 1e-6, less[] = {5, y - h}, more[] = {5, y + h};
      CHECK(f.value(PathDual(t), x).d[0].c0 == Approx((f.value(t, more) - f.value(t, less)) / (2 * h)).margin(1e-8));
      CHECK(f.slope(t, p).d[0] == Approx((f.value(t + h, p) - f.value(t - h, p)) / (2 * h)).margin(1e-8));
    }
  // At the place itself the side of positive values.
  const double at[] = {0, 1};
  const FormulaLaw g("abs(y - 1)", {"a"}, others);
  PathDual x[] = {PathDual(0), PathDual(1)};
  x[1].d[0] = Taylor2(1.0);
  CHECK(g.value(0, at) == 0);
  CHECK(g.value(PathDual(0), x).d[0].c0 == 1);
}

// Against the same written with the laws themselves, on every scalar that elements are compiled for.
TEST_CASE("laws: a formula calls laws beside it", "[law]") {
  const auto lines = std::make_shared<DataLaw>(std::vector<double>{-1, 0.5, 2}, std::vector<double>{3, 0, 1},
                                               DataLaw::Between::lines, DataLaw::Beyond::hold, "the data");
  const auto step = std::make_shared<SmoothStepLaw>();
  std::vector<std::string> others;
  const std::vector<FormulaFunction> functions = {{"air", lines, 1}, {"rise", step, 2}};
  const FormulaLaw f("a*air(y^2 - t)*rise(y) + air(0.3)",
                     {"a", "air.scale", "rise.from", "rise.to", "rise.before", "rise.after"}, others, functions);
  REQUIRE(others == std::vector<std::string>{"y"});
  CHECK((f.calls(0) && f.calls(1)));
  for (const double t : {-0.4, 0.3, 1.1})
    for (const double y : {-1.2, 0.4, 0.9}) {
      CAPTURE(t, y);
      const double p[] = {5, 1.5, 0.1, 1.2, 2, -1, y}, at = y * y - t;
      const double air = lines->value(at, p + 1), rise = step->value(y, p + 2), rest = lines->value(0.3, p + 1);
      CHECK(f.value(t, p) == rounded(5 * air * rise + rest));
      CHECK(f.slope(t, p).d[0] == rounded(-5 * lines->slope(at, p + 1).d[0] * rise));
      const Taylor2 air_t = lines->curve(at, p + 1);
      CHECK(f.curve(t, p).c2 == Approx(5 * air_t.c2 * rise).margin(1e-12));
      // By y, twice: u = air(y^2 - t), w = rise(y).
      PathDual x[7];
      for (int i = 0; i < 7; ++i) x[i] = PathDual(p[i]);
      x[6] = PathDual(Taylor2(y, 1, 0));
      x[6].d[0] = Taylor2(1.0);
      const PathDual u = lines->value(x[6] * x[6] - PathDual(t), x + 1), w = step->value(x[6], x + 2);
      const PathDual whole = f.value(PathDual(t), x);
      CHECK(whole.v.c2 == rounded(5 * (u * w).v.c2));
      CHECK(whole.d[0].c1 == rounded(5 * (u * w).d[0].c1));
      // Of its numbers: the step's height.
      x[6] = PathDual(y);
      x[5].d[0] = Taylor2(1.0);
      CHECK(f.value(PathDual(t), x).d[0].c0 == rounded(5 * air * step->value(x[6], x + 2).d[0].c0));
      // The lines' kinks, of both calls.
      std::vector<double> bends;
      f.add_bends(t, p, bends);
      REQUIRE(bends.size() == 6);
      CHECK(bends[0] == rounded(at + 1));
      CHECK(bends[2] == rounded(at - 2));
      CHECK(bends[4] == rounded(0.3 - 0.5));
    }
  // Along its variable the places of a law are where its argument comes to them.
  LawPlaces places;
  places.to = 10;
  const double p[] = {1, 1, 0.1, 1.2, 2, -1};
  FormulaLaw("air(2*t - 4)", {"a", "air.scale"}, others, {functions[0]}).add_places(p, places);
  CHECK(places.sharp == std::vector<double>{1.5, 2.25, 3});
}

TEST_CASE("laws: what is no formula is refused with its place", "[law]") {
  const auto complaint = [](const std::string& text) -> std::string {
    try {
      FormulaLaw(text, {"amplitude"});
    } catch (const ModelError& e) {
      return e.what();
    }
    return "none";
  };
  CHECK_THAT(complaint(""), Contains("at its character 1") && Contains("it ends where"));
  CHECK_THAT(complaint("2*"), Contains("character 3"));
  CHECK_THAT(complaint("(1 + 2"), Contains("a ')' is missing"));
  CHECK_THAT(complaint("1 2"), Contains("character 3: '2' is unexpected"));
  CHECK_THAT(complaint("2*amplitud"), Contains("'amplitud' is unknown") && Contains("Did you mean 'amplitude'?"));
  CHECK_THAT(complaint("sin x"), Contains("'sin' needs its argument in parentheses"));
  CHECK_THAT(complaint("abs(x)"), Contains("'abs' bends at places"));
  CHECK_THAT(complaint("1 + $"), Contains("'$' stands where"));
  std::string deep = "x", far = "x";
  for (int i = 0; i < 20; ++i) deep = "1 + (" + deep + ")*2";
  for (int i = 0; i < 200; ++i) far = "(" + far + ")";
  CHECK_THAT(complaint(deep), Contains("nested too deeply"));
  CHECK_THAT(complaint(far), Contains("too many parentheses"));
}
