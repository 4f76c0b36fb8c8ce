// Explicit Runge-Kutta schemes with an embedded estimate of their error and a dense output, as tables of coefficients.
// A new one is one file that registers itself; an integrator of its name steps by it (lib/README.md (9)).
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace costate {

/// Stage i evaluates at t + c_i h and Y_i = y + h sum over j < i of a_ij k_j. The weights of the step are row `stages`
/// of a: that stage evaluates at the step's end, and is the first one of the next step. Stages behind it serve the
/// dense output alone.
struct ExplicitScheme {
  std::string name;     // of the integrator, and of the scheme
  std::string summary;  // one line for `costate list`
  int order = 0;        // of the steps
  int stages = 0;
  std::vector<double> c = {};
  std::vector<std::vector<double>> a = {};  // rows of any length up to i
  // The error is h times the sum of weights `error`; with `error_low`, those of an estimate of lower order, it is
  // e^2 / sqrt(e^2 + 0.01 e_low^2), of the step's order.
  std::vector<double> error = {}, error_low = {};
  // y(t + x h) = y + x (d + (1 - x) (h k_0 - d + x (2 d - h (k_0 + k_end) + (1 - x) (D_1 + x (D_2 + ...))))), d the
  // step's change and D_i = h times the sum of these weights.
  std::vector<std::vector<double>> dense = {};
  double stability = 0;  // |h lambda| on the negative real axis up to which it is stable

  /// When stage i of the step of h from t, which ends at t_end, evaluates.
  double time(int i, double t, double h, double t_end) const {
    return std::min(t + c[static_cast<std::size_t>(i)] * h, t_end);
  }
  const std::vector<double>& weights() const { return a[static_cast<std::size_t>(stages)]; }
  double weight(int i) const {
    const auto& b = weights();
    return static_cast<std::size_t>(i) < b.size() ? b[static_cast<std::size_t>(i)] : 0;
  }
};

/// All registered schemes, in order of rising order.
const std::vector<ExplicitScheme>& explicit_schemes();
/// Null when there is none of that name.
const ExplicitScheme* find_explicit_scheme(const std::string& name);

struct RegisterExplicitScheme {
  explicit RegisterExplicitScheme(ExplicitScheme scheme);
};

}  // namespace costate
