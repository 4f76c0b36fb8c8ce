// The linear system of the start, [Phi_q; B] x = b with a row of B for each given coordinate or rate: dense
// where a mechanism is small, else part by part of what no element connects, larger parts by sparse factors.
// (Also the rank of Phi_q, start.h, is found so.)
#pragma once

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <memory>
#include <optional>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

/// Least-squares solver with full column rank.
class GivenSystem {
 public:
  /// Positions know nothing of rows that bind velocities alone (assembly/rolling_rows.h).
  enum class Of { positions, velocities };
  GivenSystem(const Assembly& assembly, const std::vector<GivenStart>& given, Of of);
  ~GivenSystem();

  int rows() const { return rows_; }
  /// Rates among the given velocities depend on the positions q.
  void factor(const double* q);
  /// Square and regular: then the constraint rows are independent and the number of given values is right.
  bool determines() const { return rows_ == assembly_.n() && rank() == rows_; }
  int rank() const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;
  /// y (rows()) with w^T solve(b) = y^T b for every b.
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& w) const;
  /// A coordinate that the given ones leave undetermined (largest entry of a null vector), for messages.
  int undetermined() const;

 private:
  struct FactoredPart;
  void scale(const double* q);
  const Assembly& assembly_;
  const std::vector<GivenStart>& given_;
  const Of of_;
  int rows_;
  Eigen::SparseMatrix<double> matrix_;  // scaled
  Eigen::VectorXd row_, column_;        // factors of its rows and columns
  std::optional<Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>> dense_;
  std::vector<FactoredPart> parts_;
};

}  // namespace costate
