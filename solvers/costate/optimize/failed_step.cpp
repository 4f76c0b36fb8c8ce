#include "costate/optimize/failed_step.h"

#include <algorithm>
#include <cmath>

namespace costate {

namespace {
const OptimizerEvaluation& last_before(const std::vector<OptimizerEvaluation>& list, std::size_t index) {
  while (list[--index].failed()) {
  }
  return list[index];
}
}  // namespace

FailedStep::FailedStep(const ParameterSelection& parameters, const std::vector<OptimizerEvaluation>& list,
                       std::size_t failed, std::size_t best)
    : best_(list[best]), last_(last_before(list, failed)) {
  const std::vector<double>& rho = list[failed].rho;
  double squared = 0, p = 0;
  for (std::size_t j = 0; j < rho.size(); ++j) {
    const double scale = parameters.parameters[j].scale;
    direction_.push_back((rho[j] - best_.rho[j]) / scale);
    squared += direction_[j] * direction_[j];
    p += best_.gradient[j] * scale * direction_[j];
  }
  for (double& s : direction_) s /= squared;
  // A step along which psi does not change needs a rise all the same.
  slope_ = std::max(std::abs(p), 1e-6 * std::abs(best_.psi));
  if (slope_ == 0) slope_ = 1e-6;
}

double FailedStep::psi() const { return std::max(best_.psi, last_.psi) + slope_; }

double FailedStep::constraint(std::size_t c, double size) const {
  return std::max(best_.constraints[c], last_.constraints[c]) + constraint_rise(c, size);
}

double FailedStep::constraint_rise(std::size_t c, double size) const {
  return std::max({std::abs(best_.constraints[c]), std::abs(last_.constraints[c]), 1e-3 * size});
}

void FailedStep::gradient(double rise, std::vector<double>& g) const {
  for (std::size_t j = 0; j < g.size(); ++j) g[j] = j < direction_.size() ? 3 * rise * direction_[j] : 0.0;
}

}  // namespace costate
