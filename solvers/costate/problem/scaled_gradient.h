// The size of a gradient or a Hessian: its largest entry times its parameters' scales, which make derivatives by unlike
// parameters comparable.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/mechanism/parameter.h"

namespace costate {

/// max |g_j| s_j, in the cost's unit; 0 without parameters.
inline double largest_scaled(const ParameterSelection& parameters, const std::vector<double>& gradient) {
  double largest = 0;
  for (std::size_t j = 0; j < gradient.size(); ++j)
    largest = std::max(largest, std::abs(gradient[j]) * parameters.parameters[j].scale);
  return largest;
}

/// The same, or 1e-3 of psi where derivatives are smaller: those have no size of their own.
inline double gradient_size(const ParameterSelection& parameters, double psi, const std::vector<double>& gradient) {
  return std::max(1e-3 * std::abs(psi), largest_scaled(parameters, gradient));
}

/// max |a_j - b_j| s_j of two gradients of the same length.
inline double largest_scaled_change(const ParameterSelection& parameters, const std::vector<double>& a,
                                    const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t j = 0; j < b.size(); ++j)
    largest = std::max(largest, std::abs(a[j] - b[j]) * parameters.parameters[j].scale);
  return largest;
}

inline Eigen::VectorXd scales(const ParameterSelection& parameters) {
  Eigen::VectorXd s(parameters.size());
  for (Eigen::Index j = 0; j < s.size(); ++j) s[j] = parameters.parameters[static_cast<std::size_t>(j)].scale;
  return s;
}

/// max |H_ij| s_i s_j of second derivatives; 0 without parameters.
inline double largest_scaled(const Eigen::VectorXd& s, const Eigen::MatrixXd& H) {
  return s.size() > 0 ? (s.asDiagonal() * H * s.asDiagonal()).cwiseAbs().maxCoeff() : 0;
}

}  // namespace costate
