// A scene of models/ with its reference functional, for benchmarks.
#pragma once

#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate::bench {

struct Model {
  std::string name;
  Problem problem;
  double psi = 0;                // of reference.json
  std::vector<double> gradient;  // likewise, in the order of the problem's parameters

  double psi_error(double x) const;
  /// The largest difference per parameter's scale against the largest entry.
  double gradient_error(const std::vector<double>& x) const;
};

/// `scene` is a path below models/; its parameters and end time are those of the reference.
Model load_model(const std::string& scene);

}  // namespace costate::bench
