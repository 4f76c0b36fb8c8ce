// One evaluation of an optimization: psi, the constraints, their gradients; or why there are none.
#pragma once

#include <string>
#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

class Evaluator {
 public:
  Evaluator(const Problem& problem, const std::string& method, const std::vector<OptimizerConstraint>& constraints,
            const OptimizerOptions& options)
      : problem_(problem), method_(method), constraints_(constraints), options_(options) {}

  /// At e.rho, at e.rtol where there is one; `before`: the evaluations so far. A failure is noted in e; of the first it
  /// is thrown, as interruptions are.
  void compute(OptimizerEvaluation& e, const std::vector<OptimizerEvaluation>& before);

 private:
  void evaluate(OptimizerEvaluation& e, const std::vector<OptimizerEvaluation>& before);
  /// A run that needs many times the steps of its neighbours is stuck somewhere.
  void limit_steps(SolverOptions& solver, const std::vector<OptimizerEvaluation>& before);
  void require_finite(const GradientResult& r, const std::string& what) const;

  const Problem& problem_;
  const std::string& method_;
  const std::vector<OptimizerConstraint>& constraints_;
  const OptimizerOptions& options_;
  long step_limit_ = 0;  // of the evaluation being made; 0: the solver's own
};

}  // namespace costate
