// The tape of an explicit scheme: stages with their records (what an evaluation has made, matrices factored), where
// that does not fit the stages alone, and where they do not fit either the state at every K-th step, from which the
// stages between are computed again, a segment at a time.
#pragma once

#include <memory>
#include <vector>

#include "costate/discrete/explicit_derivative.h"
#include "costate/discrete/explicit_step.h"
#include "costate/integrator/step_tape.h"

namespace costate {

class ExplicitTape : public StepTape {
 public:
  /// segment_steps: K, or 0 for one that follows from `bytes`, once stages do not fit.
  ExplicitTape(OdeSystem& system, const ExplicitScheme& scheme, double bytes, long segment_steps);

  /// The records of stages are kept from here on (StageAdjoint), of this step as it evaluates.
  void keep_records_of(ExplicitStep& step);
  /// A step that was taken, in the mode in force.
  void add_step(const ExplicitStep& step);
  /// The stages of step k, in the mode that it was taken in, which comes into force; k falls from the last to 0.
  ExplicitStages bring_back(long k);
  /// Evaluations made on the way back.
  long evaluations() const { return repeated_ ? repeated_->evaluations() : 0; }

 private:
  std::size_t stage_entries() const { return static_cast<std::size_t>(n_) * static_cast<std::size_t>(scheme_.stages); }
  std::size_t record_entries() const { return record_ * static_cast<std::size_t>(scheme_.stages); }
  /// Behind the stages lie their records.
  void keep_stages(Step& step, const ExplicitStep& of, bool records) const;
  /// From all steps, and from here on.
  void drop_records();

  OdeSystem& system_;
  const ExplicitScheme& scheme_;
  int n_;
  std::size_t record_ = 0;  // numbers of one stage
  bool records_fit_ = true;
  std::vector<double> records_;  // of the step that is being taken, one stage more
  std::unique_ptr<ExplicitStep> repeated_;
};

}  // namespace costate
