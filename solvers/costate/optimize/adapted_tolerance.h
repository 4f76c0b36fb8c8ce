// The tolerance that an optimization's evaluations need: loose where much is gained by a step, tighter as less is, so
// that errors stay small parts of the progress. With errors of psi about A rtol and of a scaled derivative B rtol,
//   A rtol <= kOfProgress max(|g_b . s|, a tenth of the last decrease)   and   B rtol <= kOfGradient |projected g_b|,
// where s is the step from the best point b and g_b the gradient there, in scaled parameters. A and B are what two
// tolerances differ by: at the first point, which is evaluated at ten times the loosest one first, and at the best one
// whenever the tolerance changes. It never loosens, and follows from the evaluations alone, so that a run repeats
// itself.
#pragma once

#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

class AdaptedTolerance {
 public:
  /// Powers of a hundred of the final tolerance, up to 3e-4, and ten times the last one; `on`: false, the final one
  /// alone.
  AdaptedTolerance(double final_rtol, bool on);

  double rtol() const { return levels_[level_]; }
  bool adapting() const { return levels_.size() > 1; }
  bool last() const { return level_ == 0; }
  /// Of the tolerance in use and the next one.
  double next() const { return levels_[last() ? 0 : level_ - 1]; }

  /// Whether errors are known, from one point at two tolerances.
  bool known() const { return known_; }
  void learn(const OptimizerEvaluation& loose, const OptimizerEvaluation& tight, const ParameterSelection& parameters);
  /// The tolerance for a step from `best` to rho, no looser than the one in use.
  double needed(const OptimizerEvaluation& best, const std::vector<double>& rho, double last_decrease) const;
  void tighten_to(double rtol);

 private:
  std::vector<double> levels_;  // ascending
  std::size_t level_ = 0;
  bool known_ = false;
  double psi_error_ = 0, gradient_error_ = 0;  // by rtol: A, B
};

/// What evaluations at one tolerance took.
struct ToleranceShare {
  double rtol = 0;
  int evaluations = 0;
  double wall_s = 0;
};
struct Adaptation {
  std::vector<ToleranceShare> tolerances;  // the loosest first
  int again = 0;                           // points that were evaluated before, at another tolerance
  double spent_s = 0;
  double fixed_s = 0;  // about what the points would have taken at the last tolerance throughout
};
/// Of a run that adapted to `final_rtol`, which is that of evaluations that have none of their own; replayed ones count
/// as they were.
Adaptation adaptation_of(const std::vector<OptimizerEvaluation>& evaluations, double final_rtol);

}  // namespace costate
