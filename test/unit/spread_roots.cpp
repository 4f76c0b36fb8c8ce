// Eigenvalues of matrices whose entries differ by many orders of magnitude.
#include "costate/analysis/spread_roots.h"

#include <catch2/catch.hpp>

using namespace costate;

// A tyre's lateral force on a car that is free along x, by the cosine of pi/2 both in its direction and in its slip.
TEST_CASE("spread roots: the square of a rounded right angle is no damping") {
  const double across = 6.123233995736766e-17, damping = 1e2;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(4, 4);
  A(0, 1) = 1;
  A(1, 1) = -damping * across * across;
  A(2, 3) = 1;
  A(3, 2) = -100;
  A(3, 3) = -2;
  const Roots apart = find_roots(A, A.cwiseAbs());
  CHECK(apart.zeros == 2);
  REQUIRE(apart.roots.size() == 1);
  CHECK(std::abs(apart.roots[0].value - std::complex<double>(-1, std::sqrt(99.0))) < 1e-13);
  // Coupled with the rest it is a root of the same matrix.
  A(1, 3) = damping * across;
  A(3, 1) = -damping * across;
  const Roots together = find_roots(A, A.cwiseAbs());
  CHECK(together.zeros == 2);
  REQUIRE(together.roots.size() == 1);
  // What is slow by twelve orders and acts along is a root.
  A(1, 3) = A(3, 1) = 0;
  A(1, 1) = -1e-12;
  CHECK(find_roots(A, A.cwiseAbs()).zeros == 1);
}
