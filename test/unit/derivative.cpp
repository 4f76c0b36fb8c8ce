// Dual and Taylor numbers against closed-form derivatives and against differences of themselves.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "costate/derivative/dual.h"

using namespace costate;

namespace {

/// Each function of the library with its first three derivatives in closed form.
struct Elementary {
  std::string name;
  double x;
  std::function<Taylor2(const Taylor2&)> taylor;
  std::function<Dual<2>(const Dual<2>&)> dual;
  std::function<PathDual(const PathDual&)> path;
  double f0, f1, f2, f3;
};

std::vector<Elementary> elementary_functions() {
  std::vector<Elementary> r;
  const auto add = [&](std::string name, double x, auto f, double f0, double f1, double f2, double f3) {
    r.push_back({std::move(name), x, f, f, f, f0, f1, f2, f3});
  };
  const double x = 0.7, e = std::exp(x), t = std::tanh(x), a = 1 / (1 + x * x);
  add(
      "sqrt", x, [](const auto& y) { return sqrt(y); }, std::sqrt(x), 0.5 * std::pow(x, -0.5),
      -0.25 * std::pow(x, -1.5), 0.375 * std::pow(x, -2.5));
  add(
      "sin", x, [](const auto& y) { return sin(y); }, std::sin(x), std::cos(x), -std::sin(x), -std::cos(x));
  add(
      "cos", x, [](const auto& y) { return cos(y); }, std::cos(x), -std::sin(x), -std::cos(x), std::sin(x));
  add(
      "exp", x, [](const auto& y) { return exp(y); }, e, e, e, e);
  add(
      "log", x, [](const auto& y) { return log(y); }, std::log(x), 1 / x, -1 / (x * x), 2 / (x * x * x));
  add(
      "tanh", x, [](const auto& y) { return tanh(y); }, t, 1 - t * t, -2 * t * (1 - t * t),
      (1 - t * t) * (6 * t * t - 2));
  add(
      "atan", x, [](const auto& y) { return atan(y); }, std::atan(x), a, -2 * x * a * a, a * a * a * (6 * x * x - 2));
  add(
      "pow 2.5", x, [](const auto& y) { return pow(y, 2.5); }, std::pow(x, 2.5), 2.5 * std::pow(x, 1.5),
      3.75 * std::pow(x, 0.5), 1.875 * std::pow(x, -0.5));
  add(
      "abs", -x, [](const auto& y) { return abs(y); }, x, -1, 0, 0);
  add(
      "fabs", x, [](const auto& y) { return fabs(y); }, x, 1, 0, 0);
  const double tan_x = std::tan(x), d = 1 + tan_x * tan_x;
  add(
      "tan", x, [](const auto& y) { return tan(y); }, tan_x, d, 2 * tan_x * d, 2 * d * d + 4 * tan_x * tan_x * d);
  const double s = 1 / std::sqrt(1 - x * x), s3 = s * s * s, third = s3 + 3 * x * x * s3 * s * s;
  add(
      "asin", x, [](const auto& y) { return asin(y); }, std::asin(x), s, x * s3, third);
  add(
      "acos", x, [](const auto& y) { return acos(y); }, std::acos(x), -s, -x * s3, -third);
  add(
      "sinh", x, [](const auto& y) { return sinh(y); }, std::sinh(x), std::cosh(x), std::sinh(x), std::cosh(x));
  add(
      "cosh", x, [](const auto& y) { return cosh(y); }, std::cosh(x), std::sinh(x), std::cosh(x), std::sinh(x));
  const double l = 1 / (1 + x), e2 = std::log(2.0), e10 = std::log(10.0);
  add(
      "log1p", x, [](const auto& y) { return log1p(y); }, std::log1p(x), l, -l * l, 2 * l * l * l);
  add(
      "expm1", x, [](const auto& y) { return expm1(y); }, std::expm1(x), e, e, e);
  add(
      "cbrt", -x, [](const auto& y) { return cbrt(y); }, -std::cbrt(x), std::pow(x, -2.0 / 3) / 3,
      2 * std::pow(x, -5.0 / 3) / 9, 10 * std::pow(x, -8.0 / 3) / 27);
  add(
      "log10", x, [](const auto& y) { return log10(y); }, std::log10(x), 1 / (x * e10), -1 / (x * x * e10),
      2 / (x * x * x * e10));
  add(
      "log2", x, [](const auto& y) { return log2(y); }, std::log2(x), 1 / (x * e2), -1 / (x * x * e2),
      2 / (x * x * x * e2));
  // Of two arguments, each of them the one that varies, or both.
  const double r2 = x * x + 4, h = std::sqrt(r2);
  add(
      "hypot", x, [](const auto& y) { return hypot(y, 2.0); }, h, x / h, 4 / (h * r2), -12 * x / (h * r2 * r2));
  add(
      "atan2 of y", x, [](const auto& y) { return atan2(y, -2.0); }, std::atan2(x, -2.0), -2 / r2, 4 * x / (r2 * r2),
      4 / (r2 * r2) - 16 * x * x / (r2 * r2 * r2));
  add(
      "atan2 of x", x, [](const auto& y) { return atan2(2.0, y); }, std::atan2(2.0, x), -2 / r2, 4 * x / (r2 * r2),
      4 / (r2 * r2) - 16 * x * x / (r2 * r2 * r2));
  // f = x^(x x) has f' = f g with g = x (2 log x + 1), f'' = f (g g + g'), and so on.
  const double x2 = x * x, f = std::pow(x, x2), g = x * (2 * std::log(x) + 1), g1 = 2 * std::log(x) + 3;
  add(
      "pow of both", x, [](const auto& y) { return pow(y, y * y); }, f, f * g, f * (g * g + g1),
      f * (g * g * g + 3 * g * g1 + 2 / x));
  const double p2 = std::pow(2, x);
  add(
      "pow of a number", x, [](const auto& y) { return pow(2.0, y); }, p2, e2 * p2, e2 * e2 * p2, e2 * e2 * e2 * p2);
  return r;
}

/// Rounding of a few operations on numbers of size 1 to 10.
Approx close(double x) { return Approx(x).epsilon(1e-14).margin(1e-14); }

void check_equal(const Taylor2& x, double c0, double c1, double c2) {
  CHECK(x.c0 == close(c0));
  CHECK(x.c1 == close(c1));
  CHECK(x.c2 == close(c2));
}

}  // namespace

TEST_CASE("dual numbers: elementary functions", "[derivative]") {
  for (const Elementary& f : elementary_functions()) {
    CAPTURE(f.name);
    // f(x(s)) for a path with slope u and curvature w: f' u and f'' u^2 + f' w.
    const double u = 0.3, w = -1.1;
    check_equal(f.taylor(Taylor2(f.x, u, w)), f.f0, f.f1 * u, f.f2 * u * u + f.f1 * w);
    Dual<2> y(f.x);
    y.d = {2.0, -3.0};
    const Dual<2> g = f.dual(y);
    CHECK(g.v == close(f.f0));
    CHECK(g.d[0] == close(2 * f.f1));
    CHECK(g.d[1] == close(-3 * f.f1));
    // The partial derivative of value, slope and curvature when x0, u and w change at rates a, b, c.
    const double a = 0.5, b = -0.8, c = 1.7;
    PathDual p(Taylor2(f.x, u, w));
    p.d[0] = Taylor2(a, b, c);
    const PathDual q = f.path(p);
    check_equal(q.v, f.f0, f.f1 * u, f.f2 * u * u + f.f1 * w);
    check_equal(q.d[0], f.f1 * a, f.f2 * a * u + f.f1 * b,
                f.f3 * a * u * u + 2 * f.f2 * u * b + f.f2 * a * w + f.f1 * c);
  }
}

TEST_CASE("dual numbers: whole powers at zero", "[derivative]") {
  // Where x^n ends, no power of 0 below it is asked for, which is infinite.
  PathDual x(Taylor2(0, 3, 5));
  x.d[0] = Taylor2(7, 11, 13);
  const auto check = [&](const PathDual& y, const PathDual& product) {
    check_equal(y.v, product.v.c0, product.v.c1, product.v.c2);
    check_equal(y.d[0], product.d[0].c0, product.d[0].c1, product.d[0].c2);
  };
  check(pow(x, 0), 1.0);
  check(pow(x, 1), x);
  check(pow(x, 2), x * x);
  check(pow(x, 3), x * x * x);
  check(pow(x, PathDual(2.0)), x * x);
}

TEST_CASE("dual numbers: arithmetic", "[derivative]") {
  // x = 2 + 3 s + 5 s^2/2, y = 7 - s + 4 s^2/2.
  const Taylor2 x(2, 3, 5), y(7, -1, 4);
  check_equal(x + y, 9, 2, 9);
  check_equal(x - y, -5, 4, 1);
  check_equal(-x, -2, -3, -5);
  check_equal(x * y, 14, 2 * -1 + 3 * 7, 5 * 7 + 2 * 3 * -1 + 2 * 4);
  // (x y) / y = x
  check_equal(x * y / y, 2, 3, 5);
  check_equal(x / y * y, 2, 3, 5);
  check_equal(x + 1.0, 3, 3, 5);
  check_equal(2.0 * x, 4, 6, 10);

  Dual<1> a = Dual<1>::variable(1.5, 0), b(0.4);
  CHECK((a * a * b).d[0] == close(2 * 1.5 * 0.4));
  CHECK((b / a).d[0] == close(-0.4 / (1.5 * 1.5)));
  CHECK((b - a).d[0] == -1);
  CHECK((-a).d[0] == -1);
  CHECK((a + a).d[0] == 2);
  CHECK((a / a).d[0] == close(0));
  a *= a;
  CHECK(a.v == 2.25);
  CHECK(a.d[0] == 3);

  const Dual<3> z = Dual<3>::variable(2, 1);
  CHECK(z.d[0] == 0);
  CHECK(z.d[1] == 1);
  CHECK(z.d[2] == 0);
  CHECK(value_of(PathDual(Taylor2(4, 5, 6))) == 4);
  CHECK(value_of(z) == 2);
}

TEST_CASE("dual numbers: mixed derivatives along a path", "[derivative]") {
  // d/dp of value, rate and second rate of f(q(t), p) = sin(p q) / (1 + q^2) on q = 0.4 + 0.9 t - 1.3 t^2 / 2, against
  // central differences over p, good to h^2 = 1e-8.
  const auto f = [](const PathDual& q, const PathDual& p) { return sin(p * q) / (1.0 + q * q); };
  const PathDual q(Taylor2(0.4, 0.9, -1.3));
  PathDual p(1.7);
  p.d[0] = Taylor2(1.0);
  const PathDual d = f(q, p);
  const double h = 1e-4;
  const Taylor2 up = f(q, PathDual(1.7 + h)).v, down = f(q, PathDual(1.7 - h)).v;
  CHECK(d.d[0].c0 == Approx((up.c0 - down.c0) / (2 * h)).epsilon(1e-7));
  CHECK(d.d[0].c1 == Approx((up.c1 - down.c1) / (2 * h)).epsilon(1e-7));
  CHECK(d.d[0].c2 == Approx((up.c2 - down.c2) / (2 * h)).epsilon(1e-7));
}
