#include "costate/optimize/adapted_tolerance.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {

constexpr double kLoosest = 3e-4, kStep = 100, kProbe = 10;
// What errors may be of what a step gains, and of the gradient.
constexpr double kOfProgress = 0.02, kOfGradient = 0.02;
// A step that happens to be short, or along a level line, does not stand for what the iterations gain.
constexpr double kOfLast = 0.1;

}  // namespace

AdaptedTolerance::AdaptedTolerance(double final_rtol, bool on) : levels_{final_rtol} {
  while (on && levels_.back() * kStep <= kLoosest) levels_.push_back(levels_.back() * kStep);
  // What tells the errors of the loosest one that is worked with.
  if (levels_.size() > 1) levels_.push_back(kProbe * levels_.back());
  level_ = levels_.size() - 1;
}

void AdaptedTolerance::learn(const OptimizerEvaluation& loose, const OptimizerEvaluation& tight,
                             const ParameterSelection& parameters) {
  known_ = true;
  psi_error_ = std::abs(loose.psi - tight.psi) / loose.rtol;
  gradient_error_ = largest_scaled_change(parameters, loose.gradient, tight.gradient) / loose.rtol;
  // Two that agree by chance: no error is below its tolerance.
  psi_error_ = std::max(psi_error_, std::abs(tight.psi));
  gradient_error_ = std::max(gradient_error_, tight.projected_gradient);
}

double AdaptedTolerance::needed(const OptimizerEvaluation& best, const std::vector<double>& rho,
                                double last_decrease) const {
  double gain = 0;
  for (std::size_t j = 0; j < rho.size(); ++j) gain += best.gradient[j] * (rho[j] - best.rho[j]);
  gain = std::max(std::abs(gain), kOfLast * last_decrease);
  std::size_t level = level_;
  const auto loose = [&](double rtol) {
    return psi_error_ * rtol > kOfProgress * gain || gradient_error_ * rtol > kOfGradient * best.projected_gradient;
  };
  while (level > 0 && loose(levels_[level])) --level;
  return levels_[level];
}

void AdaptedTolerance::tighten_to(double rtol) {
  while (level_ > 0 && levels_[level_] > rtol) --level_;
}

Adaptation adaptation_of(const std::vector<OptimizerEvaluation>& evaluations, double final_rtol) {
  Adaptation a;
  std::set<std::vector<double>> points;
  for (const OptimizerEvaluation& e : evaluations) {
    if (!points.insert(e.rho).second) ++a.again;
    a.spent_s += e.wall_s;
    const double rtol = e.rtol > 0 ? e.rtol : final_rtol;
    auto t = std::find_if(a.tolerances.begin(), a.tolerances.end(), [&](const auto& s) { return s.rtol == rtol; });
    if (t == a.tolerances.end()) t = a.tolerances.insert(t, {rtol, 0, 0});
    ++t->evaluations;
    t->wall_s += e.wall_s;
  }
  std::sort(a.tolerances.begin(), a.tolerances.end(), [](const auto& s, const auto& t) { return s.rtol > t.rtol; });
  if (!a.tolerances.empty()) {
    const ToleranceShare& last = a.tolerances.back();
    a.fixed_s = last.wall_s / last.evaluations * static_cast<double>(points.size());
  }
  return a;
}

}  // namespace costate
