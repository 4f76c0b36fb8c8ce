#include "costate/linear/sparse_pattern.h"

#include <algorithm>

namespace costate {

std::int64_t SparsePattern::find(int i, int j) const {
  const auto first = row.begin() + column_start[j], last = row.begin() + column_start[j + 1];
  const auto at = std::lower_bound(first, last, static_cast<std::int64_t>(i));
  return at != last && *at == i ? at - row.begin() : -1;
}

SparsePattern SparsePattern::from_entries(int rows, int cols, std::vector<std::pair<int, int>> e) {
  std::sort(e.begin(), e.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second < b.second : a.first < b.first;
  });
  e.erase(std::unique(e.begin(), e.end()), e.end());
  SparsePattern p;
  p.rows = rows;
  p.cols = cols;
  p.column_start.assign(static_cast<std::size_t>(cols) + 1, 0);
  p.row.reserve(e.size());
  for (const auto& [i, j] : e) {
    p.row.push_back(i);
    ++p.column_start[static_cast<std::size_t>(j) + 1];
  }
  for (int j = 0; j < cols; ++j) p.column_start[j + 1] += p.column_start[j];
  return p;
}

SparsePattern SparsePattern::identity(int n) {
  std::vector<std::pair<int, int>> e;
  for (int i = 0; i < n; ++i) e.emplace_back(i, i);
  return from_entries(n, n, std::move(e));
}

void add_product(const SparsePattern& A, const double* values, double c, const double* x, double* y) {
  for (int j = 0; j < A.cols; ++j) {
    const double cx = c * x[j];
    for (auto k = A.column_start[j]; k < A.column_start[j + 1]; ++k) y[A.row[k]] += values[k] * cx;
  }
}

void add_transposed_product(const SparsePattern& A, const double* values, double c, const double* x, double* y) {
  for (int j = 0; j < A.cols; ++j) {
    double sum = 0;
    for (auto k = A.column_start[j]; k < A.column_start[j + 1]; ++k) sum += values[k] * x[A.row[k]];
    y[j] += c * sum;
  }
}

void add_products(const SparsePattern& p, const double* A, const double* B, double c, const double* x, const double* z,
                  double* y) {
  for (int j = 0; j < p.cols; ++j) {
    const double cx = c * x[j], cz = c * z[j];
    for (auto k = p.column_start[j]; k < p.column_start[j + 1]; ++k) y[p.row[k]] += A[k] * cx + B[k] * cz;
  }
}

void add_transposed_products(const SparsePattern& p, const double* A, const double* B, double c, const double* x,
                             double* y, double* w) {
  for (int j = 0; j < p.cols; ++j) {
    double a = 0, b = 0;
    for (auto k = p.column_start[j]; k < p.column_start[j + 1]; ++k) {
      const double xi = x[p.row[k]];
      a += A[k] * xi;
      b += B[k] * xi;
    }
    y[j] += c * a;
    w[j] += c * b;
  }
}

int BlockMatrix::place(const SparsePattern& block, int row, int column, bool transposed) {
  std::vector<std::pair<int, int>> at;
  at.reserve(block.row.size());
  for (int j = 0; j < block.cols; ++j)
    for (auto k = block.column_start[j]; k < block.column_start[j + 1]; ++k) {
      const int i = static_cast<int>(block.row[k]);
      at.emplace_back(row + (transposed ? j : i), column + (transposed ? i : j));
    }
  placed_.push_back(std::move(at));
  return static_cast<int>(placed_.size()) - 1;
}

void BlockMatrix::finalize() {
  std::vector<std::pair<int, int>> all;
  for (const auto& b : placed_) all.insert(all.end(), b.begin(), b.end());
  pattern_ = SparsePattern::from_entries(size_, size_, std::move(all));
  slots_.resize(placed_.size());
  for (std::size_t b = 0; b < placed_.size(); ++b) {
    slots_[b].clear();
    for (const auto& [i, j] : placed_[b]) slots_[b].push_back(pattern_.find(i, j));
  }
  placed_.clear();
  placed_.shrink_to_fit();
  values_.assign(pattern_.row.size(), 0.0);
}

void BlockMatrix::set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

void BlockMatrix::add(int block, const double* values, double factor) {
  const auto& slots = slots_[block];
  for (std::size_t k = 0; k < slots.size(); ++k) values_[slots[k]] += factor * values[k];
}

void BlockMatrix::add_constant(int block, double factor) {
  for (const auto k : slots_[block]) values_[k] += factor;
}

}  // namespace costate
