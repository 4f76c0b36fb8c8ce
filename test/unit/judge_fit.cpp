// What is said of a point where a search of least squares has ended: by residuals that are lines of the parameters,
// r = A rho - b, whose least is known.
#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "costate/base/notice.h"
#include "costate/fit/fit.h"

using namespace costate;
using Catch::Contains;
using Catch::Detail::Approx;

namespace {

FitResult judged(const Eigen::Vector2d& beside) {
  Eigen::MatrixXd A(5, 2);
  A << 1, 0, 1, 1, 1, 2, 1, 3, 1, 4;
  Eigen::VectorXd b(5);
  b << 0.3, 1.1, 1.8, 3.2, 4.1;
  const Eigen::VectorXd least = A.householderQr().solve(b);
  const Eigen::VectorXd rho = least + beside;
  SampleResiduals at;
  at.r = A * rho - b;
  at.r_rho = A;
  FitResult r;
  for (int j = 0; j < 2; ++j) {
    FittedParameter p;
    p.name = j == 0 ? "a" : "b";
    p.value = rho[j];
    p.lower = -100;
    p.upper = 100;
    r.parameters.push_back(p);
  }
  r.chi_square = at.r.squaredNorm();
  r.converged = true;
  r.termination = "converged";
  judge_fit(at, {at}, {}, r);
  take_notices();
  return r;
}

}  // namespace

TEST_CASE("fit: a search that ends beside the least has not converged") {
  const FitResult there = judged({0, 0});
  CHECK(there.converged);
  CHECK(there.parameters[0].integration_error == Approx(0).margin(1e-14));
  // (J^T J)^-1 has sqrt(0.6) and sqrt(0.1) as standard errors: steps of 0.03 of them are nothing, and part of what is
  // stated.
  const FitResult near_by = judged({0.02, 0.005});
  CHECK(near_by.converged);
  CHECK(near_by.parameters[0].integration_error == Approx(0.02).epsilon(1e-9));
  CHECK(near_by.parameters[1].integration_error == Approx(0.005).epsilon(1e-9));
  const FitResult beside = judged({0.3, 0});
  CHECK_FALSE(beside.converged);
  CHECK_THAT(beside.termination, Contains("short of the least"));
}
