// One evaluation of an optimization: psi, the constraints, their gradients; or why there are none. Cases are run beside
// each other, jobs() at a time (record/jobs.h), with the same numbers.
#pragma once

#include <string>
#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

class Evaluator {
 public:
  Evaluator(const Design& design, const OptimizerOptions& options)
      : design_(design), bounds_(design.bounds()), options_(options) {}

  /// At e.rho, at e.rtol where there is one; `before`: the evaluations so far. A failure is noted in e; of the first it
  /// is thrown, as interruptions are.
  void compute(OptimizerEvaluation& e, const std::vector<OptimizerEvaluation>& before);

 private:
  /// What the run of a case gives: its psi and its constraints, in the case's own parameters.
  struct CaseValues {
    GradientResult cost;
    std::vector<GradientResult> constraints;
  };
  void evaluate(OptimizerEvaluation& e, const std::vector<OptimizerEvaluation>& before);
  CaseValues run(std::size_t c, OptimizerEvaluation& e);
  /// psi of the design, from those of its cases.
  void combine(OptimizerEvaluation& e, const std::vector<CaseValues>& values) const;
  /// A run that needs many times the steps of its neighbours is stuck somewhere.
  void limit_steps(const std::vector<OptimizerEvaluation>& before);

  const Design& design_;
  const std::vector<DesignBound> bounds_;
  const OptimizerOptions& options_;
  long step_limit_ = 0;  // of each run of the evaluation being made; 0: the solver's own
};

}  // namespace costate
