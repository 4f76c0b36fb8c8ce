#include "costate/element/law/scalar_law.h"

#include <fmt/format.h>

#include <Eigen/Dense>

#include "costate/base/error.h"

namespace costate {

TableLaw::TableLaw(std::vector<double> x) : x_(std::move(x)) {
  const auto n = static_cast<Eigen::Index>(x_.size());
  if (n < 2) throw ModelError("", fmt::format("A table needs at least 2 points, found {}.", n));
  for (Eigen::Index i = 1; i < n; ++i)
    if (!(x_[i] > x_[i - 1]))
      throw ModelError(
          "", fmt::format("A table's abscissae must increase: entry {} is {} after {}.", i + 1, x_[i], x_[i - 1]));
  // h_{k-1}/6 m_{k-1} + (h_{k-1}+h_k)/3 m_k + h_k/6 m_{k+1} = secant_k - secant_{k-1}, m_0 = m_{n-1} = 0.
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n), B = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index k = 1; k + 1 < n; ++k) {
    const double hl = x_[k] - x_[k - 1], hr = x_[k + 1] - x_[k];
    A(k, k - 1) = hl / 6;
    A(k, k) = (hl + hr) / 3;
    A(k, k + 1) = hr / 6;
    B(k, k - 1) = 1 / hl;
    B(k, k) = -1 / hl - 1 / hr;
    B(k, k + 1) = 1 / hr;
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const RowMajor m = A.partialPivLu().solve(B);
  moments_.assign(m.data(), m.data() + n * n);
}

}  // namespace costate
