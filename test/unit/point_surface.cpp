// Maps: surfaces through points over a grid.
#include "costate/element/law/point_surface.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "costate/base/error.h"
#include "costate/derivative/dual.h"

using namespace costate;
using Catch::Contains;
using Between = PointSurface::Between;
using Beyond = PointSurface::Beyond;

namespace {

const std::vector<double> kX = {-1, 0.2, 0.9, 2, 2.5}, kY = {0, 1, 1.5, 4};

std::vector<double> grid(double (*f)(double, double)) {
  std::vector<double> z;
  for (const double y : kY)
    for (const double x : kX) z.push_back(f(x, y));
  return z;
}
double wavy(double x, double y) { return std::sin(2 * x + y) + x * y * y; }

PointSurface surface(double (*f)(double, double), Between between, Beyond beyond = Beyond::refuse) {
  return {kX, kY, grid(f), between, beyond, "The map"};
}

}  // namespace

TEST_CASE("map: a spline of splines, in either order", "[map]") {
  const PointSurface map = surface(wavy, Between::spline);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> along_x(-1, 2.5), along_y(0, 4);
  for (int k = 0; k < 200; ++k) {
    const double x = along_x(random), y = along_y(random);
    double f[5];
    // Curves along x, and one along y through their values; and the other way about.
    std::vector<double> at_x, at_y;
    for (const double b : kY) {
      std::vector<double> row;
      for (const double a : kX) row.push_back(wavy(a, b));
      PointCurve(kX, row, Between::spline).calc_derivatives(x, f);
      at_x.push_back(f[0]);
    }
    for (const double a : kX) {
      std::vector<double> row;
      for (const double b : kY) row.push_back(wavy(a, b));
      PointCurve(kY, row, Between::spline).calc_derivatives(y, f);
      at_y.push_back(f[0]);
    }
    PointCurve(kY, at_x, Between::spline).calc_derivatives(y, f);
    CHECK(map.value(x, y) == Approx(f[0]).epsilon(1e-12).margin(1e-12));
    PointCurve(kX, at_y, Between::spline).calc_derivatives(x, f);
    CHECK(map.value(x, y) == Approx(f[0]).epsilon(1e-12).margin(1e-12));
  }
  for (const double y : kY)
    for (const double x : kX) CHECK(map.value(x, y) == Approx(wavy(x, y)).epsilon(1e-13).margin(1e-13));
}

TEST_CASE("map: straight lines give what is bilinear", "[map]") {
  const auto f = [](double x, double y) { return 1 + 2 * x - 3 * y + 0.5 * x * y; };
  for (const Between between : {Between::lines, Between::spline}) {
    const PointSurface map = surface(f, between, Beyond::tangent), held = surface(f, between, Beyond::hold);
    for (double x = -3; x <= 5; x += 0.37)
      for (double y = -2; y <= 7; y += 0.41) {
        CHECK(map.value(x, y) == Approx(f(x, y)).epsilon(1e-12).margin(1e-12));
        const double at_x = std::clamp(x, -1.0, 2.5), at_y = std::clamp(y, 0.0, 4.0);
        CHECK(held.value(x, y) == Approx(f(at_x, at_y)).epsilon(1e-12).margin(1e-12));
      }
  }
}

TEST_CASE("map: derivatives are those of differences, inside and beyond", "[map]") {
  for (const Beyond beyond : {Beyond::hold, Beyond::tangent})
    for (const Between between : {Between::lines, Between::spline}) {
      const PointSurface map = surface(wavy, between, beyond);
      for (const double x : {-1.7, -0.4, 0.55, 1.3, 2.2, 3.1})
        for (const double y : {-0.8, 0.3, 1.2, 2.9, 4.6}) {
          using D = Dual<2>;
          const D z = map.value(D::variable(x, 0), D::variable(y, 1));
          // Of cubics the difference with h leaves h^2/6 times the third derivative, below 40 here.
          const double h = 1e-4, most = 40 * h * h / 6 + 1e-11;
          CHECK(z.v == map.value(x, y));
          CHECK(std::abs(z.d[0] - (map.value(x + h, y) - map.value(x - h, y)) / (2 * h)) <= most);
          CHECK(std::abs(z.d[1] - (map.value(x, y + h) - map.value(x, y - h)) / (2 * h)) <= most);
        }
    }
}

TEST_CASE("map: where its slopes jump", "[map]") {
  std::vector<double> bends;
  surface(wavy, Between::spline).add_bends(0.5, 2, bends);
  CHECK(bends.empty());
  surface(wavy, Between::lines).add_bends(0.5, 2, bends);
  CHECK(bends == std::vector<double>{0.5 - 0.2, 0.5 - 0.9, 0.5 - 2, 2 - 1, 2 - 1.5});
  bends.clear();
  surface(wavy, Between::spline, Beyond::hold).add_bends(0.5, 2, bends);
  CHECK(bends == std::vector<double>{0.5 + 1, 0.5 - 2.5, 2, 2 - 4});
}

TEST_CASE("map: mistakes are told", "[map]") {
  const auto make = [](const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z) {
    return PointSurface(x, y, z, Between::spline, Beyond::refuse, "The map");
  };
  CHECK_THROWS_WITH(make({1}, {0, 1}, {1, 2}), Contains("at least 2 places along x"));
  CHECK_THROWS_WITH(make({0, 1}, {0, 0}, {1, 2, 3, 4}), Contains("along y must increase: 0 comes after 0"));
  CHECK_THROWS_WITH(make({0, 1}, {0, 1}, {1, 2, 3}), Contains("needs 4 values for 2 x and 2 y, found 3"));
  CHECK_THROWS_WITH(make({0, 1}, {0, 1}, {1, 2, 3, std::nan("")}), Contains("no finite numbers"));
  CHECK_THROWS_WITH(surface(wavy, Between::lines).value(3.0, 1.0),
                    Contains("along x from -1 to 2.5") && Contains("asked for at 3") && Contains("beyond"));
  CHECK_THROWS_WITH(surface(wavy, Between::lines).value(0.0, -0.1), Contains("along y from 0 to 4"));
}
