#include "costate/linear/least_squares.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "costate/base/stop.h"

namespace costate {

namespace {

// Of columns of length 1: what elimination leaves of a dependent one, and what the best combination of the others does.
constexpr double kNothing = 1e-11, kCombined = 1e-9;
constexpr std::size_t kMostFill = 20, kStopsEvery = 1024;
constexpr int kCorrections = 2;

Eigen::SparseMatrix<double> saddle(const Eigen::SparseMatrix<double>& A) {
  const auto n = static_cast<int>(A.rows());
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n; ++i) entries.emplace_back(i, i, -1.0);
  for (int j = 0; j < A.outerSize(); ++j)
    for (Eigen::SparseMatrix<double>::InnerIterator e(A, j); e; ++e) {
      entries.emplace_back(static_cast<int>(e.row()), n + j, e.value());
      entries.emplace_back(n + j, static_cast<int>(e.row()), e.value());
    }
  Eigen::SparseMatrix<double> all(n + A.cols(), n + A.cols());
  all.setFromTriplets(entries.begin(), entries.end());
  all.makeCompressed();
  return all;
}

/// The columns that nothing is left of once each of the others has been solved for one of its rows; nothing where that
/// makes far more entries than there were.
std::optional<std::vector<int>> eliminated(const Eigen::SparseMatrix<double>& A) {
  const auto count = static_cast<std::size_t>(A.cols());
  std::vector<std::map<int, double>> columns(count);
  std::vector<std::set<int>> rows(static_cast<std::size_t>(A.rows()));  // the columns that hold it and are not solved
  std::set<std::pair<std::size_t, int>> by_length;
  for (int j = 0; j < A.outerSize(); ++j) {
    auto& column = columns[static_cast<std::size_t>(j)];
    for (Eigen::SparseMatrix<double>::InnerIterator e(A, j); e; ++e)
      if (e.value() != 0) {
        column[static_cast<int>(e.row())] = e.value();
        rows[static_cast<std::size_t>(e.row())].insert(j);
      }
    by_length.insert({column.size(), j});
  }
  auto entries = static_cast<std::size_t>(A.nonZeros());
  const std::size_t most = kMostFill * entries;
  std::vector<int> left;
  while (!by_length.empty()) {
    if (by_length.size() % kStopsEvery == 0) check_stop();
    const int of = by_length.begin()->second;
    by_length.erase(by_length.begin());
    const auto& pivots = columns[static_cast<std::size_t>(of)];
    if (pivots.empty()) {
      left.push_back(of);
      continue;
    }
    const auto [row, pivot] = *std::max_element(pivots.begin(), pivots.end(), [](const auto& a, const auto& b) {
      return std::abs(a.second) < std::abs(b.second);
    });
    for (const auto& [i, x] : pivots) rows[static_cast<std::size_t>(i)].erase(of);
    const std::set<int> others = rows[static_cast<std::size_t>(row)];
    for (const int j : others) {
      auto& column = columns[static_cast<std::size_t>(j)];
      by_length.erase({column.size(), j});
      entries -= column.size();
      const double factor = column.at(row) / pivot;
      for (const auto& [i, x] : pivots) {
        double& to = column[i];
        to = i == row ? 0 : to - factor * x;
        if (std::abs(to) > kNothing) {
          rows[static_cast<std::size_t>(i)].insert(j);
        } else {
          column.erase(i);
          rows[static_cast<std::size_t>(i)].erase(j);
        }
      }
      entries += column.size();
      by_length.insert({column.size(), j});
    }
    if (entries > most) return std::nullopt;
  }
  std::sort(left.begin(), left.end());
  return left;
}

}  // namespace

LeastSquares::LeastSquares(const Eigen::SparseMatrix<double>& A)
    : matrix_(saddle(A)), saddle_(matrix_), rows_(A.rows()) {}

// The inverse is as large as that of A^T A: what that costs in digits is won back by what a solution leaves.
Eigen::MatrixXd LeastSquares::corrected(const Eigen::MatrixXd& right) {
  Eigen::MatrixXd x = saddle_.solve(right);
  for (int k = 0; k < kCorrections; ++k) x += saddle_.solve(right - matrix_ * x);
  return x;
}

Eigen::MatrixXd LeastSquares::solve(const Eigen::MatrixXd& b) {
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(matrix_.rows(), b.cols());
  right.topRows(rows_) = b;
  return corrected(right).bottomRows(matrix_.rows() - rows_);
}

Eigen::VectorXd LeastSquares::solve_transposed(const Eigen::VectorXd& w) {
  Eigen::VectorXd right = Eigen::VectorXd::Zero(matrix_.rows());
  right.tail(w.size()) = w;
  return corrected(right).col(0).head(rows_);
}

std::optional<std::vector<int>> dependent_columns(const Eigen::SparseMatrix<double>& A) {
  const auto left = eliminated(A);
  if (!left) return std::nullopt;
  std::vector<char> is_left(static_cast<std::size_t>(A.cols()), 0);
  for (const int j : *left) is_left[static_cast<std::size_t>(j)] = 1;
  std::vector<Eigen::Triplet<double>> entries;
  int kept = 0;
  for (int j = 0; j < A.outerSize(); ++j) {
    if (is_left[static_cast<std::size_t>(j)] != 0) continue;
    for (Eigen::SparseMatrix<double>::InnerIterator e(A, j); e; ++e)
      entries.emplace_back(static_cast<int>(e.row()), kept, e.value());
    ++kept;
  }
  Eigen::SparseMatrix<double> independent(A.rows(), kept);
  independent.setFromTriplets(entries.begin(), entries.end());
  LeastSquares others(independent);
  if (!others.full_rank()) return std::nullopt;
  for (const int j : *left) {
    check_stop();
    const Eigen::VectorXd b = A.col(j);
    if (!((independent * others.solve(b) - b).norm() <= kCombined)) return std::nullopt;
  }
  return left;
}

}  // namespace costate
