// What a way back needs of a run of an explicit scheme: each step with its stages as long as they fit into the memory
// budget; else the state at every K-th step, from which the stages between are computed again, a segment at a time.
#pragma once

#include <memory>
#include <vector>

#include "costate/discrete/explicit_derivative.h"
#include "costate/discrete/explicit_step.h"
#include "costate/formulation/system.h"

namespace costate {

class ExplicitTape {
 public:
  /// segment_steps: K, or 0 for one that follows from `bytes`, once stages do not fit.
  ExplicitTape(OdeSystem& system, const ExplicitScheme& scheme, double bytes, long segment_steps);

  /// The records of stages are kept from here on (StageAdjoint), of this step as it evaluates.
  void keep_records_of(ExplicitStep& step);
  /// A step that was taken, in the mode in force.
  void add_step(const ExplicitStep& step);
  /// A jump behind the last step, and the state with which the run went on at t_after.
  void add_jump(const Jump& jump, std::vector<double> y_after);

  long steps() const { return static_cast<long>(steps_.size()); }
  /// States kept for repetitions.
  long checkpoints() const { return segment_ > 0 ? (steps() + segment_ - 1) / segment_ : 0; }
  /// The jumps behind step k, the last one first, are jumps()[jumps_end(k) - 1] down to jumps()[jumps_begin(k)].
  std::size_t jumps_begin(long k) const { return steps_[static_cast<std::size_t>(k)].jumps; }
  std::size_t jumps_end(long k) const;
  const Jump& jump(std::size_t i) const { return jumps_[i].jump; }
  /// The stages of step k, in the mode that it was taken in, which comes into force; k falls from the last to 0.
  ExplicitStages bring_back(long k);
  /// Evaluations made on the way back.
  long evaluations() const { return repeated_ ? repeated_->evaluations() : 0; }

 private:
  struct Step {
    double t, h, t_end;
    int mode;
    std::size_t jumps;             // number of jumps before it ends
    std::vector<double> y;         // at its start, of a checkpoint
    std::unique_ptr<double[]> at;  // its stages, and behind them their records, where they are kept
  };
  struct Crossing {
    Jump jump;
    std::vector<double> y_after;
  };
  std::size_t stage_entries() const { return static_cast<std::size_t>(n_) * static_cast<std::size_t>(scheme_.stages); }
  void keep_stages(Step& step, const ExplicitStep& of, bool records) const;
  void set_budget();
  void keep_checkpoints_only();

  OdeSystem& system_;
  const ExplicitScheme& scheme_;
  int n_;
  double bytes_;
  std::size_t budget_ = 0;       // of stages, in steps
  std::size_t record_ = 0;       // numbers of one stage
  std::vector<double> records_;  // of the step that is being taken, one stage more
  long segment_;
  std::vector<Step> steps_;
  std::vector<Crossing> jumps_;
  std::unique_ptr<ExplicitStep> repeated_;
};

}  // namespace costate
