#include "costate/discrete/radau_scheme.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace costate {

namespace {

using Extended = long double;
using ExtendedMatrix = Eigen::Matrix<Extended, Eigen::Dynamic, Eigen::Dynamic>;

/// P_s - P_{s-1}, Legendre's polynomials on [0, 1]; its zeros are the nodes.
Extended node_polynomial(int s, Extended x) {
  const Extended y = 2 * x - 1;
  Extended before = 1, p = y;
  for (int k = 2; k <= s; ++k) {
    const Extended next = ((2 * k - 1) * y * p - (k - 1) * before) / k;
    before = p;
    p = next;
  }
  return p - before;
}

std::vector<Extended> radau_nodes(int s) {
  std::vector<Extended> c;
  constexpr int kParts = 200, kHalvings = 70;
  for (int k = 0; k + 1 < kParts; ++k) {
    Extended low = static_cast<Extended>(k) / kParts, high = static_cast<Extended>(k + 1) / kParts;
    const bool rising = node_polynomial(s, low) < 0;
    if (rising == (node_polynomial(s, high) < 0)) continue;
    for (int i = 0; i < kHalvings; ++i) {
      const Extended middle = (low + high) / 2;
      (rising == (node_polynomial(s, middle) < 0) ? low : high) = middle;
    }
    c.push_back((low + high) / 2);
  }
  c.push_back(1);
  return c;
}

/// sum over j of a_ij c_j^k = c_i^(k+1) / (k+1), k < s.
ExtendedMatrix radau_collocation(const std::vector<Extended>& c) {
  const auto s = static_cast<Eigen::Index>(c.size());
  ExtendedMatrix powers(s, s), integrals(s, s);
  for (Eigen::Index k = 0; k < s; ++k)
    for (Eigen::Index j = 0; j < s; ++j) {
      powers(k, j) = std::pow(c[static_cast<std::size_t>(j)], static_cast<Extended>(k));
      integrals(k, j) =
          std::pow(c[static_cast<std::size_t>(j)], static_cast<Extended>(k + 1)) / static_cast<Extended>(k + 1);
    }
  return ExtendedMatrix(powers.fullPivLu().solve(integrals)).transpose();
}

/// w = T diag(shift) T^-1, one of each pair.
void split_radau(RadauScheme& r) {
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(r.w);
  const Eigen::MatrixXcd inverse = eigen.eigenvectors().inverse();
  std::vector<Eigen::Index> chosen;
  for (const bool real : {true, false})
    for (Eigen::Index k = 0; k < r.stages; ++k) {
      const double part = eigen.eigenvalues()[k].imag();
      if (real ? part == 0 : part > 0) chosen.push_back(k);
    }
  const auto count = static_cast<Eigen::Index>(chosen.size());
  r.t.resize(r.stages, count);
  r.t_inverse.resize(count, r.stages);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index from = chosen[static_cast<std::size_t>(k)];
    r.shift.push_back(eigen.eigenvalues()[from]);
    r.t.col(k) = eigen.eigenvectors().col(from);
    r.t_inverse.row(k) = inverse.row(from);
  }
}

RadauScheme make_radau(int stages) {
  RadauScheme r;
  r.stages = stages;
  r.order = 2 * stages - 1;
  r.name = fmt::format("radau{}", r.order);
  r.summary =
      fmt::format("implicit Runge-Kutta scheme Radau IIA of order {}, step control, exact discrete gradients", r.order);
  const std::vector<Extended> c = radau_nodes(stages);
  const ExtendedMatrix a = radau_collocation(c);
  for (const Extended x : c) r.c.push_back(static_cast<double>(x));
  r.a = a.cast<double>();
  r.w = ExtendedMatrix(a.inverse()).cast<double>();
  split_radau(r);
  r.filter = std::abs(r.shift.front());
  // The divided difference of y' over the beginning and the stages, scaled so that the first weight is 1/filter.
  const Extended first = 1 / static_cast<Extended>(r.filter);
  r.error.push_back(static_cast<double>(first));
  for (std::size_t i = 0; i < c.size(); ++i) {
    Extended weight = first / c[i];
    for (std::size_t j = 0; j < c.size(); ++j) {
      weight *= -c[j];
      if (j != i) weight /= c[i] - c[j];
    }
    r.error.push_back(static_cast<double>(weight));
  }
  return r;
}

}  // namespace

double RadauScheme::estimate_factor(double rtol) const {
  // The estimate falls by h^(s+1) and the steps' error by h^(2s): a tolerance of this power keeps the latter near rtol.
  constexpr double kPart = 0.1;
  return kPart * std::pow(rtol, (stages + 1.0) / (2.0 * stages) - 1);
}

const std::vector<RadauScheme>& radau_schemes() {
  static const std::vector<RadauScheme> all = {make_radau(2), make_radau(3), make_radau(5)};
  return all;
}

const RadauScheme* find_radau_scheme(const std::string& name) {
  for (const RadauScheme& s : radau_schemes())
    if (s.name == name) return &s;
  return nullptr;
}

}  // namespace costate
