// The derivative of what can only be evaluated, for checks of derivatives: where differences settle, or nothing.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace costate {

/// The derivative at 0 of f(h), a vector, by central differences of fourth order at falling steps from a hundredth of
/// `scale` on: of the first two that agree to 1e-7; none where no two do.
template <class F>
std::optional<Eigen::VectorXd> extrapolated_difference(const F& f, double scale) {
  constexpr double kAgreement = 1e-7;
  std::optional<Eigen::VectorXd> before;
  for (double h = 1e-2 * scale; h > 1e-6 * scale; h /= 4) {
    const Eigen::VectorXd ahead = f(h), behind = f(-h), d = (8 * (ahead - behind) - (f(2 * h) - f(-2 * h))) / (12 * h);
    if (!d.allFinite()) return std::nullopt;
    const double rounding = 1e-15 / h * (ahead.cwiseAbs().maxCoeff() + behind.cwiseAbs().maxCoeff());
    if (before && (d - *before).cwiseAbs().maxCoeff() <=
                      kAgreement * std::max(d.cwiseAbs().maxCoeff(), before->cwiseAbs().maxCoeff()) + rounding)
      return d;
    before = d;
  }
  return std::nullopt;
}

}  // namespace costate
