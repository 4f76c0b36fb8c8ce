// Dense algebra of parts of a system: rows, columns and entries chosen by lists of indices, and put back;
// square systems that may be empty.
#pragma once

#include <Eigen/Dense>
#include <vector>

namespace costate {

inline Eigen::VectorXd pick(const Eigen::VectorXd& x, const std::vector<int>& which) {
  Eigen::VectorXd r(static_cast<Eigen::Index>(which.size()));
  for (std::size_t i = 0; i < which.size(); ++i) r[static_cast<Eigen::Index>(i)] = x[which[i]];
  return r;
}

inline void put(const Eigen::VectorXd& x, const std::vector<int>& which, Eigen::VectorXd& out) {
  for (std::size_t i = 0; i < which.size(); ++i) out[which[i]] = x[static_cast<Eigen::Index>(i)];
}

inline Eigen::MatrixXd pick_rows(const Eigen::MatrixXd& A, const std::vector<int>& which) {
  Eigen::MatrixXd r(static_cast<Eigen::Index>(which.size()), A.cols());
  for (std::size_t i = 0; i < which.size(); ++i) r.row(static_cast<Eigen::Index>(i)) = A.row(which[i]);
  return r;
}

inline Eigen::MatrixXd pick_columns(const Eigen::MatrixXd& A, const std::vector<int>& which) {
  Eigen::MatrixXd r(A.rows(), static_cast<Eigen::Index>(which.size()));
  for (std::size_t i = 0; i < which.size(); ++i) r.col(static_cast<Eigen::Index>(i)) = A.col(which[i]);
  return r;
}

inline void put_rows(const Eigen::MatrixXd& x, const std::vector<int>& which, Eigen::MatrixXd& out) {
  for (std::size_t i = 0; i < which.size(); ++i) out.row(which[i]) = x.row(static_cast<Eigen::Index>(i));
}

inline std::vector<int> chosen(const std::vector<int>& numbers, const std::vector<int>& places) {
  std::vector<int> r;
  for (const int i : places) r.push_back(numbers[static_cast<std::size_t>(i)]);
  return r;
}

inline Eigen::MatrixXd solve_square(const Eigen::MatrixXd& A, const Eigen::MatrixXd& b) {
  if (A.rows() == 0) return Eigen::MatrixXd::Zero(0, b.cols());
  return A.partialPivLu().solve(b);
}

}  // namespace costate
