// What a way back needs of a run of a Radau IIA scheme: each step with its stages as long as they fit into the memory
// budget; else those of every K-th step, from which the steps between are taken again, a segment at a time.
#pragma once

#include <memory>
#include <vector>

#include "costate/discrete/radau_step.h"
#include "costate/formulation/system.h"

namespace costate {

class RadauTape {
 public:
  /// segment_steps: K, or 0 for one that follows from `bytes`, once stages do not fit. `atol` as that of the run.
  RadauTape(DaeSystem& system, const RadauScheme& scheme, double bytes, long segment_steps, std::vector<double> atol);

  void keep_records_of(RadauStep&) {}
  /// A step that was taken, in the mode in force.
  void add_step(const RadauStep& step);
  /// A jump behind the last step, and the state with which the run went on at t_after.
  void add_jump(const Jump& jump, std::vector<double> y_after);

  long steps() const { return static_cast<long>(steps_.size()); }
  /// Steps kept for repetitions.
  long checkpoints() const { return segment_ > 0 ? (steps() + segment_ - 1) / segment_ : 0; }
  /// The jumps behind step k, the last one first, are jump(jumps_end(k) - 1) down to jump(jumps_begin(k)).
  std::size_t jumps_begin(long k) const { return steps_[static_cast<std::size_t>(k)].jumps; }
  std::size_t jumps_end(long k) const;
  const Jump& jump(std::size_t i) const { return jumps_[i].jump; }
  /// The stages of step k, in the mode that it was taken in, which comes into force; k falls from the last to 0.
  RadauStages bring_back(long k);
  /// Evaluations made on the way back.
  long evaluations() const { return repeated_ ? repeated_->evaluations() : 0; }

 private:
  struct Step {
    double t, h, t_end;
    int mode;
    std::size_t jumps;             // number of jumps before it ends
    std::unique_ptr<double[]> at;  // its stages, where they are kept
  };
  struct Crossing {
    Jump jump;
    std::vector<double> y_after;
  };
  void keep_stages(Step& step, const RadauStep& of) const;
  bool is_checkpoint(std::size_t k) const { return segment_ > 0 && static_cast<long>(k) % segment_ == 0; }

  DaeSystem& system_;
  const RadauScheme& scheme_;
  int n_;
  std::size_t budget_;  // in steps
  long segment_;
  std::vector<double> atol_;
  std::vector<Step> steps_;
  std::vector<Crossing> jumps_;
  std::unique_ptr<RadauStep> repeated_;
};

}  // namespace costate
