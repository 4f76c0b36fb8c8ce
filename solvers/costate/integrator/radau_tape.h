// The tape of a Radau IIA scheme: where stages no longer fit, those of every K-th step stay, from which the steps
// between are taken again, a segment at a time.
#pragma once

#include <memory>
#include <vector>

#include "costate/discrete/radau_step.h"
#include "costate/integrator/step_tape.h"

namespace costate {

class RadauTape : public StepTape {
 public:
  /// segment_steps: K, or 0 for one that follows from `bytes`, once stages do not fit. `atol` as that of the run.
  RadauTape(DaeSystem& system, const RadauScheme& scheme, double bytes, long segment_steps, std::vector<double> atol);

  void keep_records_of(RadauStep&) {}
  /// A step that was taken, in the mode in force.
  void add_step(const RadauStep& step);
  /// The stages of step k, in the mode that it was taken in, which comes into force; k falls from the last to 0.
  RadauStages bring_back(long k);
  /// Evaluations made on the way back.
  long evaluations() const { return repeated_ ? repeated_->evaluations() : 0; }

 private:
  /// Of a step, as long as they and the stages fit into the budget; then of none.
  void keep_factors(const RadauStep& of);
  std::size_t stage_entries() const { return static_cast<std::size_t>(n_) * static_cast<std::size_t>(scheme_.stages); }
  void keep_stages(Step& step, const RadauStep& of) const;
  RadauStages stages_of(const Step& s) const { return {s.t, s.h, s.t_end, s.at.get(), n_}; }

  struct Factors {
    std::shared_ptr<StageMatrix> of;
    std::unique_ptr<double[]> numbers;
  };

  DaeSystem& system_;
  const RadauScheme& scheme_;
  int n_;
  std::vector<double> atol_;
  std::unique_ptr<RadauStep> repeated_;
  double bytes_left_;             // for factors
  std::vector<Factors> factors_;  // of the first steps: of all, or of none
};

}  // namespace costate
