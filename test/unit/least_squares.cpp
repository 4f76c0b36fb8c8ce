// Least squares and dependent columns of large sparse matrices: against full orthogonal factors, and on chains with
// bars twice.
#include "costate/linear/least_squares.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <random>

#include "costate/analysis/start.h"
#include "costate/analysis/undetermined_reactions.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

/// Bands of random entries, columns of length 1; each of `twice` is the sum of the two columns before it.
Eigen::SparseMatrix<double> band(int rows, int columns, const std::vector<int>& twice) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> entry(-1, 1);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(rows, columns);
  for (int j = 0; j < columns; ++j) {
    for (int i = j; i < std::min(rows, j + 4); ++i) A(i, j) = entry(random);
    A(j % rows, j) += 3;
    if (std::find(twice.begin(), twice.end(), j) != twice.end()) A.col(j) = A.col(j - 1) + A.col(j - 2);
    A.col(j).normalize();
  }
  return A.sparseView();
}

/// A chain of bars, each of `twice` there a second time; N points with two coordinates each.
std::string chain(int bars, const std::vector<int>& twice) {
  std::string text = "[gravity]\ny_m_per_s2 = -9.81\n[point.P0]\nground = true\nx_m = 0\ny_m = 0\n", given;
  const auto bar = [&](const std::string& name, int i) {
    text += fmt::format("[bar.{}]\nfrom = \"P{}\"\nto = \"P{}\"\nmass_kg = 0.1\n", name, i - 1, i);
  };
  for (int i = 1; i <= bars; ++i) {
    text += fmt::format("[point.P{}]\nx_m = {}\ny_m = {}\n", i, 0.1 * i, -0.1 * i);
    bar(fmt::format("B{}", i), i);
    given += fmt::format("\"P{}.x\", ", i);
  }
  for (const int i : twice) bar(fmt::format("T{}", i), i);
  return text + "[start]\ngiven = [" + given + "]\n[run]\nt_end_s = 1\n";
}

}  // namespace

TEST_CASE("least squares: solutions and their transposes are those of orthogonal factors") {
  const Eigen::SparseMatrix<double> A = band(60, 50, {});
  LeastSquares least(A);
  REQUIRE(least.full_rank());
  const Eigen::MatrixXd full(A), b = Eigen::MatrixXd::Random(60, 3);
  // Rounding: 1e-16 times the condition of A (below 100) for what the corrections leave.
  CHECK((least.solve(b) - full.householderQr().solve(b)).cwiseAbs().maxCoeff() <= 1e-13);
  const Eigen::VectorXd w = Eigen::VectorXd::Random(50);
  CHECK(std::abs(least.solve_transposed(w).dot(b.col(0)) - w.dot(least.solve(b).col(0))) <= 1e-13);
  CHECK_FALSE(LeastSquares(band(60, 50, {20})).full_rank());
}

TEST_CASE("least squares: dependent columns are found, as many as there are") {
  CHECK(dependent_columns(band(60, 50, {})).value() == std::vector<int>{});
  const std::vector<int> twice = {10, 20, 30, 40};
  const Eigen::SparseMatrix<double> A = band(60, 50, twice);
  const std::vector<int> found = dependent_columns(A).value();
  CHECK(found.size() == twice.size());
  CHECK(Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(Eigen::MatrixXd(A)).setThreshold(1e-9).rank() ==
        50 - static_cast<int>(found.size()));
}

TEST_CASE("least squares: a long chain with bars twice starts, and names as many rows as there are too many") {
  // Of 600 bars: above the size up to which matrices are full. Of 4,000 orthogonal factors took a minute.
  for (const int bars : {600, 4000}) {
    INFO(bars << " bars");
    const std::vector<int> twice = {100, 250, 599};
    const auto mechanism = Scene::parse(chain(bars, twice), "chain.toml").mechanism();
    Assembly assembly(mechanism, {});
    const Start start = find_start(assembly, 0, false);
    for (int i = 0; i < mechanism->coordinate_count(); ++i) {
      const double at = 0.1 * (i / 2 + 1);
      CHECK(std::abs(start.q[i] - (i % 2 == 0 ? at : -at)) <= 1e-9 * bars);
    }
    const ConstraintRank rank = constraint_rank(assembly, 0, start.q.data());
    CHECK(rank.rank == bars);
    REQUIRE(rank.dependent_rows.size() == twice.size());
    const std::vector<std::string> names = mechanism->row_names();
    for (std::size_t k = 0; k < twice.size(); ++k) {
      const std::string name = names[static_cast<std::size_t>(rank.dependent_rows[k])];
      CHECK((name == fmt::format("bar.B{}.length", twice[k]) || name == fmt::format("bar.T{}.length", twice[k])));
    }
    // How the two of a pair share a load is open, and nothing else.
    UndeterminedReactions open(assembly, 0, start.q, start.z);
    CHECK(open.rows().size() == 2 * twice.size());
  }
}
