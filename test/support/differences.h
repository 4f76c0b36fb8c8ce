// Richardson-extrapolated central differences of functions, the oracle of derivative tests.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

namespace costate::test {

/// d f(x + s e) / ds at s = 0 along a direction e, from three central differences at h, h/2, h/4. The truncation error
/// is of order h^6; rounding is about 10 eps |f| / h (with h = 1e-3: 2e-12 of the largest term in f).
template <class Function>
auto directional_difference(Function&& f, double h) {
  using Value = std::decay_t<decltype(f(h))>;  // a number or a vector
  Value d[3];
  for (int k = 0; k < 3; ++k) {
    const double step = h / (1 << k);
    const Value up = f(step), down = f(-step);
    d[k] = (up - down) / (2 * step);
  }
  const Value e0 = (4 * d[1] - d[0]) / 3, e1 = (4 * d[2] - d[1]) / 3;
  return Value((16 * e1 - e0) / 15);
}

/// The Jacobian of f at x, one column for each entry of x, with step h max(1, |x_j|).
template <class Function>
Eigen::MatrixXd difference_jacobian(Function&& f, const Eigen::VectorXd& x, double h = 1e-3) {
  Eigen::MatrixXd J;
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    const double scale = std::max(1.0, std::abs(x[j]));
    const Eigen::VectorXd column = directional_difference(
        [&](double s) {
          Eigen::VectorXd y = x;
          y[j] += s * scale;
          return Eigen::VectorXd(f(y));
        },
        h);
    if (J.size() == 0) J.resize(column.size(), x.size());
    J.col(j) = column / scale;
  }
  return J;
}

}  // namespace costate::test
