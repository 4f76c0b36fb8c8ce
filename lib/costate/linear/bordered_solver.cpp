#include "costate/linear/bordered_solver.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace costate {

namespace {

// The border's matrix is KLU's from so many unknowns on, and from fewer where it is sparse.
constexpr std::size_t kFullBorder = 48, kSmallBorder = 12;
constexpr double kFullDensity = 0.2;
// The smallest pivot, of entries scaled to 1: what is lost is its reciprocal times the rounding, 2e-12 at the worst.
constexpr double kLeastPivot = 1e-4;
constexpr int kScalings = 20;

/// Two numbers at once, wherever they lie; compilers do not take the loops below, which are short, for worth it.
typedef double Pair __attribute__((vector_size(16), aligned(8), may_alias));

[[gnu::always_inline]] inline double dot(const double* a, const double* b, int n) {
  Pair sum{};
  int i = 0;
  for (; i + 1 < n; i += 2) sum += *reinterpret_cast<const Pair*>(a + i) * *reinterpret_cast<const Pair*>(b + i);
  return i < n ? sum[0] + sum[1] + a[i] * b[i] : sum[0] + sum[1];
}
[[gnu::always_inline]] inline void subtract(double c, const double* a, int n, double* out) {
  const Pair factor{c, c};
  int i = 0;
  for (; i + 1 < n; i += 2) *reinterpret_cast<Pair*>(out + i) -= factor * *reinterpret_cast<const Pair*>(a + i);
  if (i < n) out[i] -= c * a[i];
}

/// L U of the first n of `columns` columns of n entries, with row exchanges in all of them, so that the others become
/// L^-1 P times themselves; the reciprocals of the pivots are on the diagonal.
bool eliminate(double* A, int n, int columns, int* order) {
  for (int i = 0; i < n; ++i) order[i] = i;
  double* a = A;
  for (int k = 0; k < n; ++k, a += n) {
    int p = k;
    double largest = std::abs(a[k]);
    for (int i = k + 1; i < n; ++i)
      if (std::abs(a[i]) > largest) largest = std::abs(a[p = i]);
    if (!(largest > kLeastPivot) || !std::isfinite(largest)) return false;
    if (p != k) {
      std::swap(order[k], order[p]);
      double* c = A;
      for (int j = 0; j < columns; ++j, c += n) std::swap(c[k], c[p]);
    }
    const double reciprocal = a[k] = 1 / a[k];
    for (int i = k + 1; i < n; ++i) a[i] *= reciprocal;
    double* c = a + n;
    for (int j = k + 1; j < columns; ++j, c += n)
      if (c[k] != 0) subtract(c[k], a + k + 1, n - k - 1, c + k + 1);
  }
  return true;
}

// With n columns of what eliminate() leaves, in place:
void solve_lower(const double* A, int n, double* x) {
  for (int k = 0; k < n - 1; ++k, A += n)
    if (x[k] != 0) subtract(x[k], A + k + 1, n - k - 1, x + k + 1);
}
void solve_upper(const double* A, int n, double* x) {
  A += static_cast<std::ptrdiff_t>(n) * n;
  for (int k = n - 1; k >= 0; --k) {
    A -= n;
    x[k] *= A[k];
    subtract(x[k], A, k, x);
  }
}
void solve_lower_transposed(const double* A, int n, double* x) {
  A += static_cast<std::ptrdiff_t>(n) * n;
  for (int k = n - 1; k >= 0; --k) {
    A -= n;
    x[k] -= dot(A + k + 1, x + k + 1, n - k - 1);
  }
}
void solve_upper_transposed(const double* A, int n, double* x) {
  for (int k = 0; k < n; ++k, A += n) x[k] = (x[k] - dot(A, x, k)) * A[k];
}

}  // namespace

BorderedSolver::BorderedSolver(const SparsePattern& pattern, const std::vector<int>& group) : pattern_(pattern) {
  const int n = pattern.cols;
  std::vector<int> place(static_cast<std::size_t>(n));  // in its group or in the border
  for (int i = 0; i < n; ++i) {
    const int g = group[static_cast<std::size_t>(i)];
    if (g >= static_cast<int>(groups_.size())) groups_.resize(static_cast<std::size_t>(g) + 1);
    std::vector<int>& unknowns = g < 0 ? border_ : groups_[static_cast<std::size_t>(g)].unknowns;
    place[static_cast<std::size_t>(i)] = static_cast<int>(unknowns.size());
    unknowns.push_back(i);
  }
  const auto for_each_entry = [&](auto&& f) {
    std::size_t k = 0;
    for (int j = 0; j < n; ++j)
      for (; k < static_cast<std::size_t>(pattern.column_start[static_cast<std::size_t>(j) + 1]); ++k)
        f(k, static_cast<std::size_t>(pattern.row[k]), static_cast<std::size_t>(j));
  };
  for_each_entry([&](std::size_t, std::size_t i, std::size_t j) {
    if ((group[i] < 0) == (group[j] < 0)) return;
    const auto [inner, outer] = group[i] < 0 ? std::pair(j, i) : std::pair(i, j);
    groups_[static_cast<std::size_t>(group[inner])].border.push_back(place[outer]);
  });
  std::size_t size = 0;
  const auto b = border_.size();
  std::vector<std::pair<int, int>> pairs;
  for (Group& g : groups_) {
    std::sort(g.border.begin(), g.border.end());
    g.border.erase(std::unique(g.border.begin(), g.border.end()), g.border.end());
    g.block = size;
    g.left = size + g.unknowns.size() * (g.unknowns.size() + g.border.size());
    size = g.left + g.unknowns.size() * g.border.size();
    g.order = orders_.size();
    orders_.resize(orders_.size() + g.unknowns.size());
    for (const int j : g.border)
      for (const int i : g.border) pairs.emplace_back(i, j);
  }
  border_block_ = size;
  border_order_ = orders_.size();
  for_each_entry([&](std::size_t, std::size_t i, std::size_t j) {
    if (group[i] < 0 && group[j] < 0) pairs.emplace_back(place[i], place[j]);
  });
  border_pattern_ = SparsePattern::from_entries(static_cast<int>(b), static_cast<int>(b), std::move(pairs));
  if (b > kFullBorder || (b > kSmallBorder &&
                          static_cast<double>(border_pattern_.entries()) < kFullDensity * static_cast<double>(b * b))) {
    sparse_ = std::make_unique<KluSolver>(border_pattern_);
    size += static_cast<std::size_t>(border_pattern_.entries());
  } else {
    orders_.resize(orders_.size() + b);
    size += b * b;
  }
  const auto of_border = [&](int i, int j) {
    return border_block_ + (sparse_ ? static_cast<std::size_t>(border_pattern_.find(i, j))
                                    : static_cast<std::size_t>(j) * b + static_cast<std::size_t>(i));
  };
  for (const Group& g : groups_)
    for (const int j : g.border)
      for (const int i : g.border) products_.push_back(of_border(i, j));
  place_.assign(pattern.row.size(), 0);
  for_each_entry([&](std::size_t k, std::size_t i, std::size_t j) {
    if (group[i] >= 0 && group[j] >= 0 && group[i] != group[j]) {
      between_.push_back(k);
      return;
    }
    entries_.push_back(k);
    if (group[i] < 0 && group[j] < 0) {
      place_[k] = of_border(place[i], place[j]);
      return;
    }
    const Group& g = groups_[static_cast<std::size_t>(std::max(group[i], group[j]))];
    const auto at = [&](std::size_t u) {
      return static_cast<std::size_t>(std::lower_bound(g.border.begin(), g.border.end(), place[u]) - g.border.begin());
    };
    const std::size_t rows = g.unknowns.size(), pi = static_cast<std::size_t>(place[i]),
                      pj = static_cast<std::size_t>(place[j]);
    if (group[i] < 0)
      place_[k] = g.left + at(i) * rows + pj;
    else
      place_[k] = g.block + (group[j] < 0 ? rows + at(j) : pj) * rows + pi;
  });
  data_.resize(size);
  std::size_t most = 0;
  for (const Group& g : groups_) most = std::max(most, g.unknowns.size());
  std::size_t inner = 0;
  for (const Group& g : groups_) inner += g.unknowns.size();
  work_.resize(inner);
  border_work_.resize(2 * b);
  given_.resize(static_cast<std::size_t>(n));
  left_.resize(static_cast<std::size_t>(n));
  scale_.assign(static_cast<std::size_t>(n), 1);
  entry_scale_.resize(place_.size());
}

// Rows and columns alike, towards entries of which the largest of each row is 1.
void BorderedSolver::choose_scale(const double* values) {
  const auto n = static_cast<std::size_t>(pattern_.cols);
  std::fill(scale_.begin(), scale_.end(), 1.0);
  std::vector<double> largest(n);
  const auto for_each = [&](auto&& f) {
    std::size_t k = 0;
    for (std::size_t j = 0; j < n; ++j)
      for (; k < static_cast<std::size_t>(pattern_.column_start[j + 1]); ++k)
        f(k, static_cast<std::size_t>(pattern_.row[k]), j);
  };
  for (int turn = 0; turn < kScalings; ++turn) {
    std::fill(largest.begin(), largest.end(), 0.0);
    for_each([&](std::size_t k, std::size_t i, std::size_t j) {
      const double x = std::abs(values[k]) * scale_[i] * scale_[j];
      largest[i] = std::max(largest[i], x);
      largest[j] = std::max(largest[j], x);
    });
    bool scaled = true;
    for (std::size_t i = 0; i < n; ++i)
      if (largest[i] > 0 && std::isfinite(largest[i])) {
        scale_[i] /= std::sqrt(largest[i]);
        scaled = scaled && largest[i] > 0.5 && largest[i] < 2;
      }
    if (scaled) break;
  }
  for (double& d : scale_) d = std::exp2(std::round(std::log2(d)));
  for_each([&](std::size_t k, std::size_t i, std::size_t j) { entry_scale_[k] = scale_[i] * scale_[j]; });
  scaled_ = true;
  ++scaling_;
}

bool BorderedSolver::factor(const double* values) {
  if (!scaled_) choose_scale(values);
  weak_.clear();
  std::fill(data_.begin(), data_.end(), 0.0);
  for (const std::size_t k : between_)
    if (values[k] != 0) return false;
  for (const std::size_t k : entries_) data_[place_[k]] = values[k] * entry_scale_[k];
  const std::size_t* product = products_.data();
  for (const Group& g : groups_) {
    const int n = static_cast<int>(g.unknowns.size()), b = static_cast<int>(g.border.size());
    double* A = data_.data() + g.block;
    if (!eliminate(A, n, n + b, orders_.data() + g.order)) {
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
  const int b = static_cast<int>(border_.size());
  if (b == 0) return true;
  if (!sparse_) return eliminate(data_.data() + border_block_, b, b, orders_.data() + border_order_);
  return sparse_->factor(data_.data() + border_block_) < 0 && sparse_->pivot_ratio() > kLeastPivot;
}

void BorderedSolver::solve_border(double* x, bool transposed) {
  const int b = static_cast<int>(border_.size());
  if (b == 0) return;
  if (sparse_) return transposed ? sparse_->solve_transposed(x) : sparse_->solve(x);
  const double* A = data_.data() + border_block_;
  const int* order = orders_.data() + border_order_;
  double* y = x + b;
  if (transposed) {
    solve_upper_transposed(A, b, x);
    solve_lower_transposed(A, b, x);
    std::copy_n(x, b, y);
    for (int i = 0; i < b; ++i) x[order[i]] = y[i];
  } else {
    std::copy_n(x, b, y);
    for (int i = 0; i < b; ++i) x[i] = y[order[i]];
    solve_lower(A, b, x);
    solve_upper(A, b, x);
  }
}

void BorderedSolver::solve(double* b, int columns) {
  double* s = border_work_.data();
  for (int c = 0; c < columns; ++c, b += pattern_.cols) {
    for (std::size_t i = 0; i < border_.size(); ++i)
      s[i] = scale_[static_cast<std::size_t>(border_[i])] * b[border_[i]];
    double* y = work_.data();
    for (const Group& g : groups_) {
      const int n = static_cast<int>(g.unknowns.size());
      const int* order = orders_.data() + g.order;
      for (int i = 0; i < n; ++i) {
        const auto u = static_cast<std::size_t>(g.unknowns[static_cast<std::size_t>(order[i])]);
        y[i] = scale_[u] * b[u];
      }
      solve_lower(data_.data() + g.block, n, y);
      const double* x = data_.data() + g.left;
      for (const int i : g.border) {
        s[i] -= dot(x, y, n);
        x += n;
      }
      y += n;
    }
    solve_border(s, false);
    y = work_.data();
    for (const Group& g : groups_) {
      const int n = static_cast<int>(g.unknowns.size());
      const double *A = data_.data() + g.block, *Y = A + static_cast<std::ptrdiff_t>(n) * n;
      for (const int i : g.border) {
        subtract(s[i], Y, n, y);
        Y += n;
      }
      solve_upper(A, n, y);
      for (int i = 0; i < n; ++i) {
        const auto u = static_cast<std::size_t>(g.unknowns[static_cast<std::size_t>(i)]);
        b[u] = scale_[u] * y[i];
      }
      y += n;
    }
    for (std::size_t i = 0; i < border_.size(); ++i)
      b[border_[i]] = scale_[static_cast<std::size_t>(border_[i])] * s[i];
  }
}

void BorderedSolver::solve_refined(const double* values, double* b) {
  if (border_.empty()) return solve(b);  // row exchanges alone
  const auto n = static_cast<std::size_t>(pattern_.cols);
  std::copy_n(b, n, given_.begin());
  solve(b);
  std::copy(given_.begin(), given_.end(), left_.begin());
  add_product(pattern_, values, -1, b, left_.data());
  solve(left_.data());
  for (std::size_t i = 0; i < n; ++i) b[i] += left_[i];
}

void BorderedSolver::solve_transposed(double* b, int columns) {
  double* s = border_work_.data();
  for (int c = 0; c < columns; ++c, b += pattern_.cols) {
    for (std::size_t i = 0; i < border_.size(); ++i)
      s[i] = scale_[static_cast<std::size_t>(border_[i])] * b[border_[i]];
    double* y = work_.data();
    for (const Group& g : groups_) {
      const int n = static_cast<int>(g.unknowns.size());
      for (int i = 0; i < n; ++i) {
        const auto u = static_cast<std::size_t>(g.unknowns[static_cast<std::size_t>(i)]);
        y[i] = scale_[u] * b[u];
      }
      const double *A = data_.data() + g.block, *Y = A + static_cast<std::ptrdiff_t>(n) * n;
      solve_upper_transposed(A, n, y);
      for (const int i : g.border) {
        s[i] -= dot(Y, y, n);
        Y += n;
      }
      y += n;
    }
    solve_border(s, true);
    y = work_.data();
    for (const Group& g : groups_) {
      const int n = static_cast<int>(g.unknowns.size());
      const double* x = data_.data() + g.left;
      for (const int i : g.border) {
        subtract(s[i], x, n, y);
        x += n;
      }
      solve_lower_transposed(data_.data() + g.block, n, y);
      const int* order = orders_.data() + g.order;
      for (int i = 0; i < n; ++i) {
        const auto u = static_cast<std::size_t>(g.unknowns[static_cast<std::size_t>(order[i])]);
        b[u] = scale_[u] * y[i];
      }
      y += n;
    }
    for (std::size_t i = 0; i < border_.size(); ++i)
      b[border_[i]] = scale_[static_cast<std::size_t>(border_[i])] * s[i];
  }
}

// The blocks, the orders of their rows, and the border's factors behind the number of their pivots where they are
// KLU's.
std::size_t BorderedSolver::saved_size() const {
  const std::size_t own = sparse_ ? border_block_ : data_.size();
  const std::size_t orders = (orders_.size() * sizeof(int) + sizeof(double) - 1) / sizeof(double);
  return own + orders + (sparse_ ? 1 + sparse_->saved_size() : 0);
}

void BorderedSolver::save(double* to) const {
  to = std::copy_n(data_.data(), sparse_ ? border_block_ : data_.size(), to);
  std::memcpy(to, orders_.data(), orders_.size() * sizeof(int));
  if (!sparse_) return;
  to += (orders_.size() * sizeof(int) + sizeof(double) - 1) / sizeof(double);
  *to = static_cast<double>(sparse_->pivot_order());
  sparse_->save(to + 1);
}

bool BorderedSolver::restore(long scaling, const double* from) {
  if (scaling != scaling_) return false;
  const std::size_t own = sparse_ ? border_block_ : data_.size();
  if (sparse_) {
    const double* border = from + own + (orders_.size() * sizeof(int) + sizeof(double) - 1) / sizeof(double);
    if (!sparse_->restore(static_cast<long>(*border), border + 1)) return false;
  }
  std::copy_n(from, own, data_.data());
  std::memcpy(orders_.data(), from + own, orders_.size() * sizeof(int));
  return true;
}

}  // namespace costate
