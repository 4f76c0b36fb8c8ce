// Sparse patterns, products and matrices composed of blocks.
#include <support/compare.h>
#include <support/random.h>

#include <catch2/catch.hpp>

#include "costate/linear/row_products.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST_CASE("sparse pattern: entries are sorted and unique", "[sparse]") {
  const SparsePattern p = SparsePattern::from_entries(3, 4, {{2, 1}, {0, 1}, {2, 1}, {1, 3}, {0, 0}});
  CHECK(p.rows == 3);
  CHECK(p.cols == 4);
  CHECK(p.entries() == 4);
  CHECK(p.column_start == std::vector<std::int64_t>{0, 1, 3, 3, 4});
  CHECK(p.row == std::vector<std::int64_t>{0, 0, 2, 1});
  CHECK(p.find(0, 1) == 1);
  CHECK(p.find(2, 1) == 2);
  CHECK(p.find(1, 1) == -1);
  CHECK(p.find(2, 2) == -1);
  CHECK(p.find(1, 3) == 3);
  CHECK(SparsePattern::identity(3).row == std::vector<std::int64_t>{0, 1, 2});
  const SparsePattern none = SparsePattern::from_entries(0, 0, {});
  CHECK(none.entries() == 0);
  CHECK(none.column_start == std::vector<std::int64_t>{0});
}

TEST_CASE("sparse pattern: products are those of the dense matrix", "[sparse]") {
  Random random(4);
  std::vector<std::pair<int, int>> at;
  for (int k = 0; k < 25; ++k)
    at.emplace_back(static_cast<int>(3.5 + 3.49 * random.number()), static_cast<int>(5 + 4.99 * random.number()));
  const SparsePattern p = SparsePattern::from_entries(7, 10, at);
  const VectorXd values = random.vector(p.entries());
  const MatrixXd A = dense(p, values.data());
  const VectorXd x = random.vector(10), y = random.vector(7);
  VectorXd out = y;
  add_product(p, values.data(), -0.5, x.data(), out.data());
  CHECK_ROWS_CLOSE_ABOVE(out, (y - 0.5 * A * x).eval(), 1e-15, VectorXd::Constant(7, 10));
  out = x;
  add_transposed_product(p, values.data(), 2, y.data(), out.data());
  CHECK_ROWS_CLOSE_ABOVE(out, (x + 2 * A.transpose() * y).eval(), 1e-15, VectorXd::Constant(10, 10));
}

TEST_CASE("block matrix: blocks overlap, transpose and accumulate", "[sparse]") {
  const SparsePattern a = SparsePattern::from_entries(2, 2, {{0, 0}, {1, 0}, {1, 1}});
  const SparsePattern b = SparsePattern::from_entries(1, 2, {{0, 0}, {0, 1}});
  BlockMatrix m(4);
  const int square = m.place(a, 0, 0), again = m.place(a, 1, 1), row = m.place(b, 3, 0),
            column = m.place(b, 0, 3, true), diagonal = m.place(SparsePattern::identity(4), 0, 0);
  m.finalize();
  const double va[] = {1, 2, 3}, vb[] = {5, 7};
  for (int round = 0; round < 2; ++round) {  // set_zero forgets the first
    m.set_zero();
    m.add(square, va);
    m.add(again, va, 10);
    m.add(row, vb);
    m.add(column, vb, -1);
    m.add_constant(diagonal, 100);
    MatrixXd expected(4, 4);
    expected << 101, 0, 0, -5,  //
        2, 113, 0, -7,          //
        0, 20, 130, 0,          //
        5, 7, 0, 100;
    CHECK((dense(m.pattern(), m.values().data()) - expected).cwiseAbs().maxCoeff() == 0);
  }
  BlockMatrix empty(0);
  empty.finalize();
  empty.set_zero();
  CHECK(empty.pattern().entries() == 0);
}

TEST_CASE("sparse matrix: products of rows with each other", "[sparse]") {
  Random random(11);
  std::vector<std::pair<int, int>> at{{0, 3}};
  for (int k = 0; k < 18; ++k)
    at.emplace_back(static_cast<int>((random.number() + 1) / 2 * 5), static_cast<int>((random.number() + 1) / 2 * 7));
  const SparsePattern p = SparsePattern::from_entries(6, 7, at);  // row 5 is empty
  RowProducts products(p);
  for (int round = 0; round < 2; ++round) {
    const Eigen::VectorXd values = random.vector(p.entries());
    const Eigen::MatrixXd A = dense(p, values.data());
    const Eigen::MatrixXd lower = (A * A.transpose()).triangularView<Eigen::Lower>();
    CHECK((Eigen::MatrixXd(products.of(values.data())) - lower).cwiseAbs().maxCoeff() < 1e-14);
  }
}
