#include "costate/linear/bordered_solver.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "costate/linear/balancing_scale.h"
#include "costate/linear/dense_factor.h"
#include "costate/linear/short_vectors.h"

namespace costate {

namespace {

// The border's matrix is KLU's from so many unknowns on, and from fewer where it is sparse.
constexpr std::size_t kFullBorder = 48, kSmallBorder = 12;
constexpr double kFullDensity = 0.2;
// The smallest pivot, of entries scaled to 1: what is lost is its reciprocal times the rounding, 2e-12 at the worst.
constexpr double kLeastPivot = 1e-4;

/// f(k, row, column) of each entry.
template <class F>
void for_each_entry(const SparsePattern& pattern, F&& f) {
  std::size_t k = 0;
  for (std::size_t j = 0; j < static_cast<std::size_t>(pattern.cols); ++j)
    for (; k < static_cast<std::size_t>(pattern.column_start[j + 1]); ++k)
      f(k, static_cast<std::size_t>(pattern.row[k]), j);
}

}  // namespace

BorderedSolver::BorderedSolver(const SparsePattern& pattern, const std::vector<int>& group) : pattern_(pattern) {
  const auto n = static_cast<std::size_t>(pattern.cols);
  for (const int g : group) {
    if (g >= static_cast<int>(groups_.size())) groups_.resize(static_cast<std::size_t>(g) + 1);
    if (g >= 0) ++groups_[static_cast<std::size_t>(g)].size;
  }
  for (Group& g : groups_) {
    g.first = border_;
    border_ += static_cast<std::size_t>(g.size);
  }
  rows_ = n - border_;
  std::vector<std::size_t> place(n), next;  // of each unknown, in its group or on the border
  next.assign(groups_.size() + 1, 0);
  unknown_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    place[i] = next[static_cast<std::size_t>(group[i] + 1)]++;
    unknown_[(group[i] < 0 ? border_ : groups_[static_cast<std::size_t>(group[i])].first) + place[i]] = i;
  }
  for_each_entry(pattern, [&](std::size_t, std::size_t i, std::size_t j) {
    if ((group[i] < 0) == (group[j] < 0)) return;
    const auto [inner, outer] = group[i] < 0 ? std::pair(j, i) : std::pair(i, j);
    groups_[static_cast<std::size_t>(group[inner])].border.push_back(static_cast<int>(place[outer]));
  });
  std::size_t size = 0;
  std::vector<std::pair<int, int>> pairs;
  for (Group& g : groups_) {
    std::sort(g.border.begin(), g.border.end());
    g.border.erase(std::unique(g.border.begin(), g.border.end()), g.border.end());
    const auto rows = static_cast<std::size_t>(g.size);
    g.block = size;
    g.left = size + rows * (rows + g.border.size());
    size = g.left + rows * g.border.size();
    for (const int j : g.border)
      for (const int i : g.border) pairs.emplace_back(i, j);
  }
  border_block_ = size;
  for_each_entry(pattern, [&](std::size_t, std::size_t i, std::size_t j) {
    if (group[i] < 0 && group[j] < 0) pairs.emplace_back(static_cast<int>(place[i]), static_cast<int>(place[j]));
  });
  border_pattern_ = SparsePattern::from_entries(static_cast<int>(rows_), static_cast<int>(rows_), std::move(pairs));
  const bool thin = static_cast<double>(border_pattern_.entries()) < kFullDensity * static_cast<double>(rows_ * rows_);
  if (rows_ > kFullBorder || (rows_ > kSmallBorder && thin)) sparse_ = std::make_unique<KluSolver>(border_pattern_);
  data_.resize(size + (sparse_ ? static_cast<std::size_t>(border_pattern_.entries()) : rows_ * rows_));
  pivots_.resize(sparse_ ? border_ : n);
  const auto of_border = [&](std::size_t i, std::size_t j) {
    return border_block_ +
           (sparse_ ? static_cast<std::size_t>(border_pattern_.find(static_cast<int>(i), static_cast<int>(j)))
                    : j * rows_ + i);
  };
  for (const Group& g : groups_)
    for (const int j : g.border)
      for (const int i : g.border)
        products_.push_back(of_border(static_cast<std::size_t>(i), static_cast<std::size_t>(j)));
  for_each_entry(pattern, [&](std::size_t k, std::size_t i, std::size_t j) {
    if (group[i] < 0 && group[j] < 0) {
      entries_.push_back({k, of_border(place[i], place[j])});
      return;
    }
    if (group[i] >= 0 && group[j] >= 0 && group[i] != group[j]) {
      between_.push_back(k);
      return;
    }
    const Group& g = groups_[static_cast<std::size_t>(std::max(group[i], group[j]))];
    const auto rows = static_cast<std::size_t>(g.size);
    const auto at = [&](std::size_t u) {
      return static_cast<std::size_t>(std::lower_bound(g.border.begin(), g.border.end(), static_cast<int>(place[u])) -
                                      g.border.begin());
    };
    entries_.push_back({k, group[i] < 0   ? g.left + at(i) * rows + place[j]
                           : group[j] < 0 ? g.block + (rows + at(j)) * rows + place[i]
                                          : g.block + place[j] * rows + place[i]});
  });
  work_.resize(n);
  given_.resize(n);
  left_.resize(n);
  scale_.assign(n, 1);
}

void BorderedSolver::choose_scale(const double* values) {
  scale_ = balancing_scale(pattern_, Balance::alike, [values](std::size_t k) { return std::abs(values[k]); });
  auto entry = entries_.begin();
  for_each_entry(pattern_, [&](std::size_t k, std::size_t i, std::size_t j) {
    if (entry != entries_.end() && entry->entry == k) (entry++)->scale = scale_[i] * scale_[j];
  });
  scaled_ = true;
  ++scaling_;
}

bool BorderedSolver::factor(const double* values) {
  if (!scaled_) choose_scale(values);
  weak_.clear();
  for (const std::size_t k : between_)
    if (values[k] != 0) return false;
  std::fill(data_.begin(), data_.end(), 0.0);
  for (const Entry& e : entries_) data_[e.place] = values[e.entry] * e.scale;
  const std::size_t* product = products_.data();
  for (const Group& g : groups_) {
    const int n = g.size, b = static_cast<int>(g.border.size());
    double* A = data_.data() + g.block;
    if (factor_lu(A, n, n + b, pivots_.data() + g.first, kLeastPivot) >= 0) {
      weak_.push_back(static_cast<int>(&g - groups_.data()));
      product += static_cast<std::ptrdiff_t>(b) * b;
      continue;
    }
    const double* Y = A + static_cast<std::ptrdiff_t>(n) * n;
    double* X = data_.data() + g.left;
    for (int i = 0; i < b; ++i) solve_upper_transposed(A, n, X + static_cast<std::ptrdiff_t>(i) * n);
    for (int j = 0; j < b; ++j, Y += n) {
      const double* x = X;
      for (int i = 0; i < b; ++i, x += n) data_[*product++] -= dot(x, Y, n);
    }
  }
  if (!weak_.empty()) return false;
  if (rows_ == 0) return true;
  double* S = data_.data() + border_block_;
  if (sparse_) return sparse_->factor(S) < 0 && sparse_->pivot_ratio() > kLeastPivot;
  const int rows = static_cast<int>(rows_);
  return factor_lu(S, rows, rows, pivots_.data() + border_, kLeastPivot) < 0;
}

void BorderedSolver::solve_border(double* s, bool transposed) {
  if (rows_ == 0) return;
  if (sparse_) return transposed ? sparse_->solve_transposed(s) : sparse_->solve(s);
  (transposed ? solve_lu_transposed : solve_lu)(data_.data() + border_block_, static_cast<int>(rows_),
                                                pivots_.data() + border_, s);
}

void BorderedSolver::solve_either(double* b, int columns, bool transposed) {
  const std::size_t n = unknown_.size();
  double* s = work_.data() + border_;
  for (int c = 0; c < columns; ++c, b += n) {
    for (std::size_t i = 0; i < n; ++i) work_[i] = scale_[unknown_[i]] * b[unknown_[i]];
    for (const Group& g : groups_) {
      const double *A = data_.data() + g.block, *Y = A + static_cast<std::ptrdiff_t>(g.size) * g.size;
      double* y = work_.data() + g.first;
      if (transposed) {
        solve_upper_transposed(A, g.size, y);
      } else {
        exchange(pivots_.data() + g.first, g.size, y);
        solve_lower(A, g.size, y);
      }
      const double* x = transposed ? Y : data_.data() + g.left;
      for (const int i : g.border) {
        s[i] -= dot(x, y, g.size);
        x += g.size;
      }
    }
    solve_border(s, transposed);
    for (const Group& g : groups_) {
      const double *A = data_.data() + g.block, *Y = A + static_cast<std::ptrdiff_t>(g.size) * g.size;
      double* y = work_.data() + g.first;
      const double* x = transposed ? data_.data() + g.left : Y;
      for (const int i : g.border) {
        subtract(s[i], x, g.size, y);
        x += g.size;
      }
      if (transposed) {
        solve_lower_transposed(A, g.size, y);
        exchange_back(pivots_.data() + g.first, g.size, y);
      } else {
        solve_upper(A, g.size, y);
      }
    }
    for (std::size_t i = 0; i < n; ++i) b[unknown_[i]] = scale_[unknown_[i]] * work_[i];
  }
}

void BorderedSolver::solve_refined(const double* values, double* b) {
  if (rows_ == 0) return solve(b);  // row exchanges alone
  std::copy_n(b, given_.size(), given_.begin());
  solve(b);
  std::copy(given_.begin(), given_.end(), left_.begin());
  add_product(pattern_, values, -1, b, left_.data());
  solve(left_.data());
  for (std::size_t i = 0; i < left_.size(); ++i) b[i] += left_[i];
}

// The blocks, their exchanges, and the border's factors behind the number of their pivots where they are KLU's.
std::size_t BorderedSolver::saved_numbers() const { return sparse_ ? border_block_ : data_.size(); }
std::size_t BorderedSolver::saved_pivots() const {
  return (pivots_.size() * sizeof(int) + sizeof(double) - 1) / sizeof(double);
}
std::size_t BorderedSolver::saved_size() const {
  return saved_numbers() + saved_pivots() + (sparse_ ? 1 + sparse_->saved_size() : 0);
}

void BorderedSolver::save(double* to) const {
  to = std::copy_n(data_.data(), saved_numbers(), to);
  std::memcpy(to, pivots_.data(), pivots_.size() * sizeof(int));
  if (!sparse_) return;
  to += saved_pivots();
  *to = static_cast<double>(sparse_->pivot_order());
  sparse_->save(to + 1);
}

bool BorderedSolver::restore(long scaling, const double* from) {
  if (scaling != scaling_) return false;
  const double *pivots = from + saved_numbers(), *border = pivots + saved_pivots();
  if (sparse_ && !sparse_->restore(static_cast<long>(*border), border + 1)) return false;
  std::copy_n(from, saved_numbers(), data_.data());
  std::memcpy(pivots_.data(), pivots, pivots_.size() * sizeof(int));
  return true;
}

}  // namespace costate
