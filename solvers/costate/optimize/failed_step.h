// What stands in for an evaluation that failed, see optimize(): a parabola along the step from the best point, in
// scaled parameters. It is above the best point and above the last, which is where some methods began this step.
#pragma once

#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

class FailedStep {
 public:
  /// To evaluation `failed` of the list, with `best` the best one before it.
  FailedStep(const ParameterSelection& parameters, const std::vector<OptimizerEvaluation>& list, std::size_t failed,
             std::size_t best);

  double psi() const;
  /// Of psi along the step, at least a millionth of it.
  double slope() const { return slope_; }
  double constraint(std::size_t c, double size) const;
  double constraint_rise(std::size_t c, double size) const;
  /// g := the gradient of a parabola that rises by `rise`, by the scaled parameters; zero behind them.
  void gradient(double rise, std::vector<double>& g) const;

 private:
  const OptimizerEvaluation &best_, &last_;
  std::vector<double> direction_;  // s / |s|^2, scaled
  double slope_ = 0;
};

}  // namespace costate
