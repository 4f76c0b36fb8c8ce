// With D = W_nn - mu W_nt s and p_n = c/D the condition s x v_t+ = 0, times D, is a trigonometric polynomial of degree
// two of the angle of s,
//   D s x v_t- + c s x (W_tn - mu W_tt s) = sum of c_k z^k,   z = exp(i angle), |k| <= 2,   c_-k = conj(c_k),
// and of z^2 times it the roots of modulus 1 are wanted, at most four. Where p_n is given D = 1.
#include "costate/event/slip_behind_impact.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

namespace costate {

namespace {
constexpr double kTwoPi = 6.283185307179586;
// Of the largest coefficient: what is less is none.
constexpr double kNoTerm = 1e-14;
// Double roots are off by the root of the rounding; what is no root is told by the residual.
constexpr double kNearCircle = 1e-4, kResidual = 1e-11, kSameAngle = 1e-7;
constexpr int kNewton = 20;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a[0] * b[1] - a[1] * b[0]; }
}  // namespace

std::vector<Eigen::Vector2d> slips_behind(const StrikingPoint& x) {
  using Complex = std::complex<double>;
  const Eigen::Matrix2d tangential = x.response.bottomRightCorner<2, 2>();
  const Eigen::Vector2d coupled = x.response.bottomLeftCorner<2, 1>(), before = x.before.tail<2>();
  const auto residual = [&](double angle) {
    const Eigen::Vector2d s(std::cos(angle), std::sin(angle));
    const double divisor = x.given ? 1 : x.response(0, 0) - x.friction * x.response.topRightCorner<1, 2>().dot(s);
    return divisor * cross(s, before) + x.normal * cross(s, coupled - x.friction * tangential * s);
  };
  std::array<Complex, 5> c{};  // of z^0 .. z^4, from as many samples
  double size = 0;
  for (int k = 0; k < 5; ++k) {
    for (int i = 0; i < 5; ++i)
      c[static_cast<std::size_t>(k)] += residual(kTwoPi * i / 5) * std::polar(0.2, -kTwoPi * i * (k - 2) / 5);
    size = std::max(size, std::abs(c[static_cast<std::size_t>(k)]));
  }
  if (!(size > 0)) return {};
  std::size_t cut = 0;  // as many terms at both ends, which are conjugates
  while (cut < 2 && std::abs(c[cut]) <= kNoTerm * size) ++cut;
  const auto degree = static_cast<Eigen::Index>(4 - 2 * cut);
  if (degree == 0) return {};
  Eigen::MatrixXcd companion = Eigen::MatrixXcd::Zero(degree, degree);
  for (Eigen::Index i = 0; i < degree; ++i) {
    if (i > 0) companion(i, i - 1) = 1;
    companion(i, degree - 1) = -c[cut + static_cast<std::size_t>(i)] / c[4 - cut];
  }
  const Eigen::VectorXcd roots = companion.eigenvalues();
  std::vector<double> angles;
  for (const Complex& z : roots) {
    if (std::abs(std::abs(z) - 1) > kNearCircle) continue;
    double angle = std::arg(z);
    for (int k = 0; k < kNewton; ++k) {
      double slope = 0;  // of sum of c_k exp(i k angle)
      for (int j = -2; j <= 2; ++j)
        slope += (Complex(0, j) * c[static_cast<std::size_t>(j + 2)] * std::polar(1.0, j * angle)).real();
      if (std::abs(slope) <= kNoTerm * size) break;
      const double step = residual(angle) / slope;
      angle -= step;
      if (std::abs(step) <= 1e-16) break;
    }
    if (std::abs(residual(angle)) > kResidual * size) continue;
    const auto same = [&](double other) { return std::abs(std::remainder(other - angle, kTwoPi)) < kSameAngle; };
    if (std::none_of(angles.begin(), angles.end(), same)) angles.push_back(angle);
  }
  std::vector<Eigen::Vector2d> directions;
  for (const double angle : angles) directions.emplace_back(std::cos(angle), std::sin(angle));
  return directions;
}

}  // namespace costate
