// What is said of the largest multiplier's derivative.
#include <catch2/catch.hpp>

#include "costate/cycle/multiplier_derivative.h"

using namespace costate;

TEST_CASE("multiplier text: how exact a derivative is, and that it is zero") {
  MultiplierDerivative d;
  d.by_rho = Eigen::Vector2d(2, -0.5);
  d.error = Eigen::Vector2d(1e-3, 1e-4);
  CHECK(multiplier_method(d) == "exact second derivatives of the return, estimated error 5e-04 of the largest entry");
  // An oscillator's two, of one modulus whatever its spring is: of the largest entry, rounding, the error is anything.
  d.by_rho = Eigen::Vector2d(5e-13, 0);
  d.error = Eigen::Vector2d(8e-12, 8e-12);
  CHECK(multiplier_method(d) ==
        "exact second derivatives of the return, zero within its estimated error, 8e-12 at most");
  // One entry that is not makes it none.
  d.by_rho = Eigen::Vector2d(5e-13, 1e-3);
  CHECK(multiplier_method(d) ==
        "exact second derivatives of the return, estimated error below 1e-06 of the largest entry");
}
