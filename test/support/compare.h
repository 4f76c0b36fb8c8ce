// Comparisons that name the worst entry.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <string>

#include "costate/linear/to_dense.h"

namespace costate::test {

/// The largest |a - b| / (scale of its row), with where it is.
struct Mismatch {
  double error = 0;
  std::string text;
};

/// Row by row: rows of a system have units of their own, so an error counts against the largest entry of its row in
/// either matrix, or against `floor[i]` where that is larger (the size of the terms that the row is a sum of).
inline Mismatch mismatch_by_rows(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                                 const Eigen::VectorXd& floor = {}) {
  Mismatch m;
  if (a.rows() != b.rows() || a.cols() != b.cols()) {
    m.error = HUGE_VAL;
    m.text = fmt::format("shapes {} x {} and {} x {}", a.rows(), a.cols(), b.rows(), b.cols());
    return m;
  }
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    double scale = floor.size() > 0 ? floor[i] : 0;
    for (Eigen::Index j = 0; j < a.cols(); ++j) scale = std::max({scale, std::abs(a(i, j)), std::abs(b(i, j))});
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      const double d = std::abs(a(i, j) - b(i, j));
      const double e = d == 0 ? 0 : d / scale;
      if (!(e <= m.error)) {  // catches NaN
        m.error = std::isfinite(e) ? e : HUGE_VAL;
        m.text = fmt::format("entry ({}, {}): {:.15g} and {:.15g}, {:.2g} of its row", i, j, a(i, j), b(i, j), e);
      }
    }
  }
  return m;
}

/// A matrix with values on a pattern, dense.
inline Eigen::MatrixXd dense(const SparsePattern& pattern, const double* values) { return to_dense(pattern, values); }

}  // namespace costate::test

/// Fails with the worst entry when a mismatch exceeds `tolerance`.
#define CHECK_BELOW(mismatch, tolerance)                  \
  do {                                                    \
    const costate::test::Mismatch mismatch_ = (mismatch); \
    INFO(mismatch_.text);                                 \
    CHECK(mismatch_.error <= (tolerance));                \
  } while (false)
/// Two matrices differ by no more than `tolerance` of their rows (of `floor` where that is larger).
#define CHECK_ROWS_CLOSE(a, b, tolerance) CHECK_BELOW(costate::test::mismatch_by_rows((a), (b)), tolerance)
#define CHECK_ROWS_CLOSE_ABOVE(a, b, tolerance, floor) \
  CHECK_BELOW(costate::test::mismatch_by_rows((a), (b), (floor)), tolerance)
