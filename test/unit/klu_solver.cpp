// The sparse direct solver: solves, re-use of pivots, and what it does when they no longer serve.
#include "costate/linear/klu_solver.h"

#include <support/compare.h>
#include <support/random.h>

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <complex>

#include "costate/linear/complex_klu_solver.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// A full pattern, so that every pivot order is possible.
SparsePattern full(int n) {
  std::vector<std::pair<int, int>> at;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) at.emplace_back(i, j);
  return SparsePattern::from_entries(n, n, at);
}

/// Backward error of a solve: eps times a small growth of pivots.
constexpr double kSolve = 1e-13;

}  // namespace

TEST_CASE("klu: solves, transposed solves, several columns", "[klu]") {
  Random random(8);
  const int n = 12;
  std::vector<std::pair<int, int>> at;
  for (int i = 0; i < n; ++i) {
    at.emplace_back(i, i);
    for (int k = 0; k < 3; ++k) at.emplace_back(i, static_cast<int>((random.number() + 1) / 2 * n));
  }
  const SparsePattern p = SparsePattern::from_entries(n, n, at);
  KluSolver solver(p);
  for (int round = 0; round < 5; ++round) {
    VectorXd values = random.vector(p.entries());
    for (int i = 0; i < n; ++i) values[p.find(i, i)] += 3;
    const MatrixXd A = dense(p, values.data());
    REQUIRE(solver.factor(values.data()) == -1);
    MatrixXd B(n, 3), X(n, 3);
    for (int k = 0; k < 3; ++k) B.col(k) = random.vector(n);
    X = B;
    solver.solve(X.data(), 3);
    CHECK((A * X - B).cwiseAbs().maxCoeff() < kSolve * 10);
    X = B;
    solver.solve_transposed(X.data(), 3);
    CHECK((A.transpose() * X - B).cwiseAbs().maxCoeff() < kSolve * 10);
  }
  CHECK(solver.counters().factorizations == 5);
  CHECK(solver.counters().full == 1);  // the pivots of the first served all others
  CHECK(solver.counters().solves == 10);
}

TEST_CASE("klu: bad pivots are noticed and replaced", "[klu]") {
  const SparsePattern p = full(3);
  KluSolver solver(p);
  MatrixXd A(3, 3);
  A << 4, 1, 1, 1, 5, 1, 1, 1, 6;
  REQUIRE(solver.factor(A.data()) == -1);
  CHECK(solver.counters().full == 1);
  A(1, 1) = 4.5;
  REQUIRE(solver.factor(A.data()) == -1);
  CHECK(solver.counters().full == 1);
  // All three pivots of the first order become tiny: elimination on them would lose 13 digits.
  for (int i = 0; i < 3; ++i) A(i, i) = 1e-13;
  const VectorXd b = VectorXd::LinSpaced(3, 1, 2);
  REQUIRE(solver.factor(A.data()) == -1);
  CHECK(solver.counters().full == 2);
  VectorXd x = b;
  solver.solve(x.data());
  CHECK((A * x - b).cwiseAbs().maxCoeff() < kSolve);
  // The new order stays as long as it serves.
  A(0, 1) = 1.5;
  REQUIRE(solver.factor(A.data()) == -1);
  CHECK(solver.counters().full == 2);
  CHECK(solver.counters().factorizations == 4);
}

TEST_CASE("klu: a singular matrix is reported with a column", "[klu]") {
  const SparsePattern p = full(3);
  MatrixXd A(3, 3);
  A << 1, 2, 3, 2, 4, 6, 1, 0, 1;  // rank 2
  KluSolver fresh(p);
  const int column = fresh.factor(A.data());
  CHECK(column >= 0);
  CHECK(column < 3);
  // The solver recovers with the next matrix.
  A(1, 1) = 5;
  REQUIRE(fresh.factor(A.data()) == -1);
  VectorXd b = VectorXd::Ones(3), x = b;
  fresh.solve(x.data());
  CHECK((A * x - b).cwiseAbs().maxCoeff() < kSolve);
  // Singular when pivots are re-used: also reported, not divided by.
  A(1, 1) = 4;
  CHECK(fresh.factor(A.data()) >= 0);
  // Singular up to rounding.
  A(1, 1) = 4 * (1 + 1e-16);
  CHECK(fresh.factor(A.data()) >= 0);
  // A column of zeros.
  A << 1, 0, 3, 2, 0, 6, 1, 0, 1;
  KluSolver other(p);
  CHECK(other.factor(A.data()) >= 0);
}

// [M J^T; J -c], with masses m and two equal rows, which c/2 in each of them alone carries: as well beside m = 1e9 as
// beside m = 1e-9 where c is some part of 1/m.
template <class Solver, class Number>
void check_badly_scaled() {
  const SparsePattern p = full(4);
  for (const double m : {1e-9, 1.0, 2e4, 1e9}) {
    CAPTURE(m);
    Eigen::Matrix<Number, -1, -1> A(4, 4);
    const double c = 1e-11 / m;
    A << m, 0, 1, 1, 0, m, 2, 2, 1, 2, -c, 0, 1, 2, 0, -c;
    Solver solver(p);
    solver.keep_pivot_orders(2);
    REQUIRE(solver.factor(A.data()) == -1);
    Eigen::Vector<Number, -1> b(4);
    b << 3 * m, m, 0, 0;
    Eigen::Vector<Number, -1> x = b, y = b;
    solver.solve(x.data());
    solver.solve_transposed(y.data());
    // lambda of each row is half of J f/(J J^T): 1/2; and a = f/m - J^T lambda.
    const double rounding = 1e-16 / 1e-11, a[2] = {2, -1};
    for (int i = 0; i < 2; ++i) {
      CHECK(std::abs(x[i] - a[i]) < 1e-10);
      CHECK(std::abs(x[2 + i] - 0.5 * m) < 100 * rounding * m);
      CHECK(std::abs(y[i] - a[i]) < 1e-10);
      CHECK(std::abs(y[2 + i] - 0.5 * m) < 100 * rounding * m);
    }
    // On the same pivots, and kept.
    REQUIRE(solver.factor(A.data()) == -1);
    auto again = b;
    solver.solve(again.data());
    CHECK((again - x).cwiseAbs().maxCoeff() <= 100 * rounding * m);
    std::vector<double> kept(solver.saved_size());
    solver.save(kept.data());
    const long order = solver.pivot_order();
    auto back = b;
    REQUIRE(solver.restore(order, kept.data()));
    solver.solve(back.data());
    CHECK(back == again);
    // Across factors of another order, whose columns are as they are.
    const Eigen::Matrix<Number, -1, -1> other = Eigen::Matrix<Number, -1, -1>::Identity(4, 4).rowwise().reverse();
    REQUIRE(solver.factor(other.data()) == -1);
    auto reversed = b;
    solver.solve(reversed.data());
    CHECK(reversed == b.reverse());
    REQUIRE(solver.restore(order, kept.data()));
    back = b;
    solver.solve(back.data());
    CHECK(back == again);
    // Without what carries them they are dependent, beside all masses.
    A(2, 2) = A(3, 3) = 0;
    CHECK(solver.factor(A.data()) >= 0);
  }
}

TEST_CASE("klu: rows that depend on each other beside large masses, and what carries them", "[klu]") {
  check_badly_scaled<KluSolver, double>();
  check_badly_scaled<ComplexKluSolver, std::complex<double>>();
}

// A body of mass m and inertia 4 m r^2 / 3 at an Euler parameter e1, none at e0, which the norm 2 e0 holds; three feet
// at r that stick, of two directions each, in rows that give by c. No balance of scales makes all pivots as large as
// they are good: e0 has the feet's largest entries. Without c it is singular.
TEST_CASE("klu: feet far from the middle of a heavy body", "[klu]") {
  for (const double m : {2.0, 2e3, 2e4, 1e6})
    for (const double r : {0.1, 1.0, 10.0, 100.0}) {
      CAPTURE(m, r);
      const int n = 11;
      MatrixXd A = MatrixXd::Zero(n, n);
      A.diagonal().head(4) << m, m, 0, 4 * m * r * r / 3;
      A(4, 2) = A(2, 4) = 2;
      const double feet[3][2] = {{r, -0.1 * r}, {-0.6 * r, 0.8 * r}, {-0.6 * r, -0.8 * r}};
      for (int i = 0; i < 3; ++i) {
        A.row(5 + 2 * i).head(4) << 1, 0, feet[i][0], -feet[i][1];
        A.row(6 + 2 * i).head(4) << 0, 1, feet[i][1], feet[i][0];
      }
      A.topRightCorner(4, 7) = A.bottomLeftCorner(7, 4).transpose();
      const SparsePattern p = full(n);
      KluSolver singular(p);
      CHECK(singular.factor(A.data()) >= 0);
      for (int i = 5; i < n; ++i) A(i, i) = -5e-11 / m;
      KluSolver solver(p);
      REQUIRE(solver.factor(A.data()) == -1);
      VectorXd x = VectorXd::Zero(n);
      x.head(2) << m, 2 * m;
      solver.solve(x.data());
      // At rest, and what the feet bear is that force: of three alike in all but their places.
      CHECK(x.head(4).cwiseAbs().maxCoeff() <= 1e-9);
      CHECK(std::abs(x[5] + x[7] + x[9] - m) <= 1e-9 * m);
      CHECK(std::abs(x[6] + x[8] + x[10] - 2 * m) <= 1e-9 * m);
    }
}

TEST_CASE("klu: complex factors are kept outside and brought back, also across another order of pivots", "[klu]") {
  // A small diagonal makes other pivots than a large one; blocks and scales are among what is kept.
  const int n = 9;
  const SparsePattern p = full(n);
  Random random(5);
  ComplexKluSolver solver(p);
  solver.keep_pivot_orders(2);
  struct Kept {
    std::vector<double> numbers;
    long order;
    Eigen::VectorXcd right, x, y;
  };
  std::vector<Kept> kept;
  for (const double diagonal : {20.0, 30.0, 1e-9}) {
    std::vector<std::complex<double>> values(p.row.size());
    for (auto& v : values) v = {random.number(), random.number()};
    for (int i = 0; i < n; ++i) values[static_cast<std::size_t>(p.find(i, i))] *= diagonal;
    REQUIRE(solver.factor(values.data()) == -1);
    Kept k{std::vector<double>(solver.saved_size()), solver.pivot_order(), Eigen::VectorXcd(n), {}, {}};
    for (auto& b : k.right) b = {random.number(), random.number()};
    k.x = k.y = k.right;
    solver.solve(k.x.data());
    solver.solve_transposed(k.y.data());
    solver.save(k.numbers.data());
    kept.push_back(std::move(k));
  }
  CHECK(kept[0].order == kept[1].order);
  REQUIRE(kept[2].order != kept[0].order);
  for (const std::size_t i : {0, 2, 1}) {
    const Kept& k = kept[i];
    REQUIRE(solver.restore(k.order, k.numbers.data()));
    Eigen::VectorXcd x = k.right, y = k.right;
    solver.solve(x.data());
    solver.solve_transposed(y.data());
    CHECK(x == k.x);  // to the bit
    CHECK(y == k.y);
  }
  solver.keep_pivot_orders(1);
  CHECK_FALSE(solver.restore(kept[2].order, kept[2].numbers.data()));  // discarded
}

TEST_CASE("klu: no unknowns", "[klu]") {
  const SparsePattern p = SparsePattern::from_entries(0, 0, {});
  KluSolver solver(p);
  CHECK(solver.factor(nullptr) == -1);
  solver.solve(nullptr);
  solver.solve_transposed(nullptr);
}
