// Sparsity patterns in compressed-column form, and matrices composed of blocks on fixed patterns:
// the structure is worked out once, the numbers are filled often and without allocation.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace costate {

struct SparsePattern {
  int rows = 0;
  int cols = 0;
  std::vector<std::int64_t> column_start;  // cols + 1
  std::vector<std::int64_t> row;           // row index of each entry, increasing within a column

  std::int64_t entries() const { return static_cast<std::int64_t>(row.size()); }
  /// Position of entry (i, j), or -1.
  std::int64_t find(int i, int j) const;

  static SparsePattern from_entries(int rows, int cols, std::vector<std::pair<int, int>> row_column);
  static SparsePattern identity(int n);
};

/// y += c A x for a matrix with values on a pattern.
void add_product(const SparsePattern& A, const double* values, double c, const double* x, double* y);
/// y += c A^T x.
void add_transposed_product(const SparsePattern& A, const double* values, double c, const double* x, double* y);
/// For two matrices on one pattern, in one pass: y += c (A x + B z); and y += c A^T x, w += c B^T x.
void add_products(const SparsePattern& pattern, const double* A, const double* B, double c, const double* x,
                  const double* z, double* y);
void add_transposed_products(const SparsePattern& pattern, const double* A, const double* B, double c, const double* x,
                             double* y, double* w);

/// A square sparse matrix composed of blocks that may overlap; add() accumulates a block's values.
class BlockMatrix {
 public:
  explicit BlockMatrix(int size) : size_(size) {}

  /// Places a block with its corner at (row, column), transposed on request; returns its id.
  int place(const SparsePattern& block, int row, int column, bool transposed = false);
  /// To be called once, after the last place() and before the first add().
  void finalize();

  const SparsePattern& pattern() const { return pattern_; }
  std::span<const double> values() const { return values_; }
  double* values_data() { return values_.data(); }

  void set_zero();
  void add(int block, const double* values, double factor = 1.0);
  /// Adds the same number on every entry of a block (an identity times `factor`).
  void add_constant(int block, double factor);

 private:
  int size_;
  std::vector<std::vector<std::pair<int, int>>> placed_;
  std::vector<std::vector<std::int64_t>> slots_;
  SparsePattern pattern_;
  std::vector<double> values_;
};

}  // namespace costate
