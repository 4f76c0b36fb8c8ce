// Radau IIA schemes: implicit, of order 2s - 1 by s stages, the last of which is the end of the step. Their tables are
// worked out from the number of stages; an integrator of its name steps by each (lib/README.md (9)).
// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5 and IV.8.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <complex>
#include <string>
#include <vector>

namespace costate {

/// Stage i solves F(t + c_i h, Y_i, Y'_i) = 0 with h Y'_i = sum of w_ij (Y_j - y) in the differential unknowns.
struct RadauScheme {
  std::string name;     // of the integrator, and of the scheme
  std::string summary;  // one line for `costate list`
  int order = 0;
  int stages = 0;
  std::vector<double> c;
  Eigen::MatrixXd a, w;  // w is the inverse of a
  // w = T diag(shift) T^-1. Of a pair of conjugates the one with the positive imaginary part is here, with its column
  // of T and its row of T^-1; a real one comes first.
  std::vector<std::complex<double>> shift;
  Eigen::MatrixXcd t, t_inverse;
  // The difference to an embedded formula of order s is h times the sum of error[i] y'_i, with y'_0 at the beginning
  // of the step. It is passed through (E filter/h + F_y)^-1 E filter/h, which leaves it where the motion is not stiff.
  std::vector<double> error;
  double filter = 0;

  /// Where steps of the order of the scheme are wanted by an error estimate of order s: the part of the tolerance that
  /// the estimate is held to.
  double estimate_factor(double rtol) const;
  /// When stage i of the step of h from t, which ends at t_end, is.
  double time(int i, double t_begin, double h, double t_end) const {
    return i == stages - 1 ? t_end : std::min(t_begin + c[static_cast<std::size_t>(i)] * h, t_end);
  }
  double weight(int i) const { return a(stages - 1, i); }
};

/// In order of rising order.
const std::vector<RadauScheme>& radau_schemes();
/// Null when there is none of that name.
const RadauScheme* find_radau_scheme(const std::string& name);

}  // namespace costate
