// The direct solver for groups and their border, and what KKT matrices do where its pivots do not serve.
#include "costate/linear/bordered_solver.h"

#include <support/compare.h>
#include <support/random.h>

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "costate/linear/kkt_solver.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Backward error of a solve: eps times a small growth of pivots, and of what they have lost (kLeastPivot).
constexpr double kSolve = 1e-13, kSolveAtWorst = 1e-11;

/// A chain of bodies of 3 unknowns, 2 of the border between each two of them, unsymmetric.
struct Chain {
  SparsePattern pattern;
  std::vector<int> group;

  explicit Chain(int bodies) {
    std::vector<std::pair<int, int>> at;
    const auto block = [&](int i, int j, int rows, int columns) {
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) at.emplace_back(i + r, j + c);
    };
    const int n = 3 * bodies, m = 2 * (bodies - 1);
    group.assign(static_cast<std::size_t>(n + m), -1);
    for (int b = 0; b < bodies; ++b) {
      block(3 * b, 3 * b, 3, 3);
      for (int i = 0; i < 3; ++i) group[static_cast<std::size_t>(3 * b + i)] = b;
      for (const int joint : {b - 1, b})
        if (joint >= 0 && joint < bodies - 1) {
          block(n + 2 * joint, 3 * b, 2, 3);
          block(3 * b, n + 2 * joint, 3, 2);
        }
    }
    block(n, n, 2, 2);  // an entry of the border's own
    pattern = SparsePattern::from_entries(n + m, n + m, std::move(at));
  }
};

void check_solves(BorderedSolver& solver, const MatrixXd& A, Random& random, double within) {
  const auto n = A.rows();
  MatrixXd B(n, 3);
  for (int k = 0; k < 3; ++k) B.col(k) = random.vector(n);
  MatrixXd X = B;
  solver.solve(X.data(), 3);
  CHECK((A * X - B).cwiseAbs().maxCoeff() < within);
  X = B;
  solver.solve_transposed(X.data(), 3);
  CHECK((A.transpose() * X - B).cwiseAbs().maxCoeff() < within);
}

}  // namespace

TEST_CASE("bordered solver: solves and transposed solves, by a full border and by a sparse one", "[linear]") {
  Random random(3);
  for (const int bodies : {1, 2, 5, 9, 20}) {  // borders of 0, 2, 8, 16, 38
    const Chain chain(std::max(bodies, 2));
    std::vector<int> group = chain.group;
    if (bodies == 1) group.assign(group.size(), 0);  // a full matrix
    BorderedSolver solver(chain.pattern, group);
    for (int round = 0; round < 4; ++round) {
      VectorXd values = random.vector(chain.pattern.entries());
      for (std::size_t i = 0; i < group.size(); ++i)
        if (const auto k = chain.pattern.find(static_cast<int>(i), static_cast<int>(i)); k >= 0) values[k] += 3;
      const MatrixXd A = dense(chain.pattern, values.data());
      REQUIRE(solver.factor(values.data()));
      check_solves(solver, A, random, kSolveAtWorst);
    }
  }
}

TEST_CASE("bordered solver: what elimination loses a refined solution has", "[linear]") {
  // Masses that differ by 1e3 from one body to the next: S loses three digits, which are in the residual.
  Random random(6);
  const int bodies = 12;
  const Chain chain(bodies);
  VectorXd values = random.vector(chain.pattern.entries());
  for (int b = 0; b < bodies; ++b)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double& x = values[chain.pattern.find(3 * b + i, 3 * b + j)];
        x = (b % 2 == 0 ? 1 : 1e3) * (i == j ? 3 + x : 0.1 * x);
      }
  BorderedSolver solver(chain.pattern, chain.group);
  REQUIRE(solver.factor(values.data()));
  const MatrixXd A = dense(chain.pattern, values.data());
  using Exact = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const Eigen::FullPivLU<Exact> lu(A.cast<long double>());
  double plain = 0, refined = 0;
  for (int k = 0; k < 20; ++k) {
    const VectorXd b = random.vector(A.rows());
    const VectorXd exact = lu.solve(Exact(b.cast<long double>())).cast<double>();
    VectorXd x = b, y = b;
    solver.solve(x.data());
    solver.solve_refined(values.data(), y.data());
    plain = std::max(plain, (x - exact).cwiseAbs().maxCoeff() / exact.cwiseAbs().maxCoeff());
    refined = std::max(refined, (y - exact).cwiseAbs().maxCoeff() / exact.cwiseAbs().maxCoeff());
  }
  CHECK(plain < kSolveAtWorst);
  CHECK(refined < 1e-14);
  CHECK(refined <= plain);
}

TEST_CASE("bordered solver: factors are kept outside and brought back", "[linear]") {
  Random random(4);
  for (const int bodies : {3, 20}) {
    const Chain chain(bodies);
    BorderedSolver solver(chain.pattern, chain.group);
    solver.keep_pivot_orders(4);
    const auto make = [&] {
      VectorXd values = random.vector(chain.pattern.entries());
      for (int i = 0; i < 3 * bodies; ++i) values[chain.pattern.find(i, i)] += 3;
      return values;
    };
    const VectorXd first = make(), second = make();
    REQUIRE(solver.factor(first.data()));
    const long scaling = solver.scaling();
    std::vector<double> kept(solver.saved_size());
    solver.save(kept.data());
    REQUIRE(solver.factor(second.data()));
    REQUIRE(solver.restore(scaling, kept.data()));
    check_solves(solver, dense(chain.pattern, first.data()), random, kSolveAtWorst);
    solver.forget_scale();
    REQUIRE(solver.factor(second.data()));
    CHECK_FALSE(solver.restore(scaling, kept.data()));  // of another scaling
    check_solves(solver, dense(chain.pattern, second.data()), random, kSolveAtWorst);
  }
}

TEST_CASE("bordered solver: units play no part", "[linear]") {
  Random random(5);
  const Chain chain(4);
  VectorXd values = random.vector(chain.pattern.entries());
  for (int i = 0; i < 12; ++i) values[chain.pattern.find(i, i)] += 3;
  const auto n = static_cast<Eigen::Index>(chain.group.size());
  const VectorXd b = random.vector(n);
  VectorXd x = b;
  BorderedSolver plain(chain.pattern, chain.group);
  REQUIRE(plain.factor(values.data()));
  plain.solve(x.data());
  // Unknowns and equations in other units, from 1e-12 to 1e12, that are powers of two: the same bits.
  VectorXd unit(n);
  for (Eigen::Index i = 0; i < n; ++i) unit[i] = std::exp2(static_cast<double>(i * 37 % 81 - 40));
  std::size_t k = 0;
  VectorXd other = values;
  for (Eigen::Index j = 0; j < n; ++j)
    for (; k < static_cast<std::size_t>(chain.pattern.column_start[static_cast<std::size_t>(j) + 1]); ++k)
      other[static_cast<Eigen::Index>(k)] *= unit[chain.pattern.row[k]] * unit[j];
  BorderedSolver scaled(chain.pattern, chain.group);
  REQUIRE(scaled.factor(other.data()));
  VectorXd y = unit.cwiseProduct(b);
  scaled.solve(y.data());
  CHECK((unit.cwiseProduct(y) - x).cwiseAbs().maxCoeff() <= kSolve * x.cwiseAbs().maxCoeff());
}

TEST_CASE("bordered solver: what would cancel is refused, and KKT matrices take the sparse solver", "[linear]") {
  // A heavy body hangs on a light one: masses 1e-12 and 1, a row to the ground and one between them, the second of
  // which has 1/m1 + 1/m2 in S, where 1/m2 is lost beside 1/m1 and left when the first row is eliminated. Each has
  // further unknowns, so that the two are too large for one group.
  constexpr int kOwn = 20, kFirst = 2 * kOwn, kSecond = kFirst + 1;
  std::vector<std::pair<int, int>> at;
  for (int i = 0; i < 2 * kOwn; ++i) at.emplace_back(i, i);
  for (const auto& [row, column] : {std::pair{kFirst, 0}, {kSecond, 0}, {kSecond, kOwn}}) {
    at.emplace_back(row, column);
    at.emplace_back(column, row);
  }
  const SparsePattern p = SparsePattern::from_entries(kSecond + 1, kSecond + 1, at);
  std::vector<int> group(kSecond + 1, -1);
  for (int i = 0; i < 2 * kOwn; ++i) group[static_cast<std::size_t>(i)] = i / kOwn;
  const auto values = [&](double m1, double m2) {
    VectorXd v = VectorXd::Zero(p.entries());
    for (int i = 0; i < 2 * kOwn; ++i) v[p.find(i, i)] = i < kOwn ? m1 : m2;
    v[p.find(kFirst, 0)] = v[p.find(0, kFirst)] = 1;
    v[p.find(kSecond, 0)] = v[p.find(0, kSecond)] = -1;
    v[p.find(kSecond, kOwn)] = v[p.find(kOwn, kSecond)] = 1;
    return v;
  };
  BorderedSolver solver(p, group);
  CHECK(solver.factor(values(1, 2).data()));
  solver.forget_scale();
  CHECK_FALSE(solver.factor(values(1e-12, 1).data()));

  KktSolver kkt(p, group);
  const VectorXd v = values(1e-12, 1);
  VectorXd b = VectorXd::Zero(kSecond + 1);
  b[0] = 1;
  b[kOwn] = 3;
  b[kSecond] = 0.5;
  for (int round = 1; round <= 8; ++round) {
    REQUIRE(kkt.factor(v.data()) == -1);
    CHECK(kkt.pivot_order() > 0);
    VectorXd x = b;
    kkt.solve(x.data());
    CHECK(x[kOwn] == Approx(0.5).epsilon(1e-14));     // a2 = a1 + 0.5, a1 = 0
    CHECK(x[kSecond] == Approx(2.5).epsilon(1e-14));  // m2 a2 + l2 = 3
    CHECK(kkt.sparse_factorizations() == round);
  }
  // Groups are not tried for ever, and serve again once nothing of before plays a part.
  REQUIRE(kkt.factor(values(1, 2).data()) == -1);
  CHECK(kkt.pivot_order() > 0);
  kkt.forget_pivots();
  REQUIRE(kkt.factor(values(1, 2).data()) == -1);
  CHECK(kkt.pivot_order() < 0);
  CHECK(kkt.sparse_factorizations() == 9);
  CHECK(kkt.factorizations() == 10);
  std::vector<double> kept(kkt.saved_size());
  kkt.save(kept.data());
  const long order = kkt.pivot_order();
  REQUIRE(kkt.factor(v.data()) == -1);
  REQUIRE(kkt.restore(order, kept.data()));
  VectorXd x = b;
  kkt.solve(x.data());
  CHECK(x[kSecond] == Approx(2).epsilon(1e-14));  // 3 - 2 * 0.5

  // Where they are small enough the two are one group, with row exchanges, and lose nothing.
  const SparsePattern small =
      SparsePattern::from_entries(4, 4, {{0, 0}, {1, 1}, {2, 0}, {0, 2}, {3, 0}, {0, 3}, {3, 1}, {1, 3}});
  VectorXd w = VectorXd::Zero(small.entries());
  w[small.find(0, 0)] = 1e-12;
  w[small.find(1, 1)] = w[small.find(2, 0)] = w[small.find(0, 2)] = w[small.find(3, 1)] = w[small.find(1, 3)] = 1;
  w[small.find(3, 0)] = w[small.find(0, 3)] = -1;
  KktSolver merged(small, {0, 1, -1, -1});
  REQUIRE(merged.factor(w.data()) == -1);
  VectorXd y(4);
  y << 1, 3, 0, 0.5;
  merged.solve(y.data());
  CHECK(merged.sparse_factorizations() == 0);
  CHECK(y[1] == Approx(0.5).epsilon(1e-14));
  CHECK(y[3] == Approx(2.5).epsilon(1e-14));
}

TEST_CASE("bordered solver: a sparse border's pivots are watched, too", "[linear]") {
  // A chain of 20 bodies along the first of their two unknowns, and one row more between the last two, which is another
  // one's but for a part of the second unknown.
  constexpr int kBodies = 20, kRows = 2 * kBodies, kMore = kRows + kBodies;
  std::vector<std::pair<int, int>> at;
  const auto link = [&](int row, int unknown) {
    at.emplace_back(row, unknown);
    at.emplace_back(unknown, row);
  };
  for (int i = 0; i < 2 * kBodies; ++i) at.emplace_back(i, i);
  for (int i = 0; i < kBodies; ++i) {
    link(kRows + i, 2 * i);
    if (i > 0) link(kRows + i, 2 * i - 2);
  }
  for (const int back : {1, 2, 4}) link(kMore, 2 * kBodies - back);
  const SparsePattern p = SparsePattern::from_entries(kMore + 1, kMore + 1, at);
  std::vector<int> group(kMore + 1, -1);
  for (int i = 0; i < 2 * kBodies; ++i) group[static_cast<std::size_t>(i)] = i / 2;
  BorderedSolver solver(p, group);
  for (const double part : {1.0, 1e-5}) {
    VectorXd v = VectorXd::Zero(p.entries());
    const auto set = [&](int row, int unknown, double x) { v[p.find(row, unknown)] = v[p.find(unknown, row)] = x; };
    for (int i = 0; i < 2 * kBodies; ++i) v[p.find(i, i)] = 1;
    for (int i = 0; i < kBodies; ++i) {
      set(kRows + i, 2 * i, 1);
      if (i > 0) set(kRows + i, 2 * i - 2, -1);
    }
    set(kMore, 2 * kBodies - 2, 1);
    set(kMore, 2 * kBodies - 4, -1);
    set(kMore, 2 * kBodies - 1, part);
    solver.forget_scale();
    CHECK(solver.factor(v.data()) == (part == 1.0));
    CHECK(solver.weak_groups().empty());
  }
}

TEST_CASE("bordered solver: an entry between two groups, and what is not finite", "[linear]") {
  const SparsePattern p = SparsePattern::from_entries(2, 2, {{0, 0}, {1, 1}, {0, 1}});
  BorderedSolver solver(p, {0, 1});
  VectorXd v = VectorXd::Zero(3);
  v[p.find(0, 0)] = v[p.find(1, 1)] = 1;
  CHECK(solver.factor(v.data()));
  v[p.find(0, 1)] = 1e-3;
  CHECK_FALSE(solver.factor(v.data()));
  v[p.find(0, 1)] = 0;
  v[p.find(1, 1)] = std::nan("");
  CHECK_FALSE(solver.factor(v.data()));
}

TEST_CASE("bordered solver: a group that is singular by itself is one with its neighbour", "[linear]") {
  // Bodies of 2 unknowns in a row, two rows between each two of them; the second has no inertia along its second
  // unknown, which is held by the rows between it and the third alone.
  const int bodies = 4, n = 2 * bodies, m = 2 * (bodies - 1);
  std::vector<std::pair<int, int>> at;
  for (int b = 0; b < bodies; ++b) {
    at.emplace_back(2 * b, 2 * b);
    at.emplace_back(2 * b + 1, 2 * b + 1);
    for (const int joint : {b - 1, b})
      for (int r = 0; joint >= 0 && joint < bodies - 1 && r < 2; ++r)
        for (int i = 0; i < 2; ++i) {
          at.emplace_back(n + 2 * joint + r, 2 * b + i);
          at.emplace_back(2 * b + i, n + 2 * joint + r);
        }
  }
  const SparsePattern p = SparsePattern::from_entries(n + m, n + m, at);
  std::vector<int> group(static_cast<std::size_t>(n + m), -1);
  for (int i = 0; i < n; ++i) group[static_cast<std::size_t>(i)] = i / 2;
  Random random(8);
  const auto values = [&](double inertia) {
    VectorXd v = VectorXd::Zero(p.entries());
    for (int i = 0; i < n; ++i) v[p.find(i, i)] = i == 3 ? inertia : 1 + 0.5 * random.number();
    for (int r = n; r < n + m; ++r)
      for (int i = 0; i < n; ++i)
        if (const auto k = p.find(r, i); k >= 0) v[k] = v[p.find(i, r)] = i == 3 && r < n + 2 ? 0 : random.number();
    return v;
  };
  KktSolver solver(p, group);
  const auto check = [&](const VectorXd& v) {
    const MatrixXd A = dense(p, v.data());
    const VectorXd b = random.vector(n + m);
    VectorXd x = b;
    solver.solve(x.data());
    CHECK((A * x - b).cwiseAbs().maxCoeff() < kSolveAtWorst * x.cwiseAbs().maxCoeff());
  };
  const VectorXd regular = values(1);
  REQUIRE(solver.factor(regular.data()) == -1);
  const long first = solver.pivot_order();
  std::vector<double> kept(solver.saved_size());
  solver.save(kept.data());
  for (int round = 0; round < 3; ++round) {
    const VectorXd singular = values(0);
    REQUIRE(solver.factor(singular.data()) == -1);
    CHECK(solver.pivot_order() != first);
    check(singular);
  }
  CHECK(solver.sparse_factorizations() == 0);
  // What was kept before the groups were merged is still known.
  REQUIRE(solver.restore(first, kept.data()));
  check(regular);
  // And from the beginning again.
  REQUIRE(solver.factor(values(0).data()) == -1);
  solver.forget_pivots();
  REQUIRE(solver.factor(regular.data()) == -1);
  CHECK_FALSE(solver.restore(first, kept.data()));
  check(regular);
  KktSolver fresh(p, group);
  REQUIRE(fresh.factor(regular.data()) == -1);
  const VectorXd b = random.vector(n + m);
  VectorXd x = b, y = b;
  solver.solve(x.data());
  fresh.solve(y.data());
  CHECK(x == y);
}
