// What a way back needs of a run of a Runge-Kutta scheme, whatever the scheme: the steps in their order, each with its
// stages as long as they fit into the memory budget, else those of every K-th step, and the jumps between them.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "costate/formulation/system.h"

namespace costate {

class StepTape {
 public:
  /// A jump behind the last step, and the state with which the run went on at t_after.
  void add_jump(const Jump& jump, std::vector<double> y_after) { jumps_.push_back({jump, std::move(y_after)}); }

  long steps() const { return static_cast<long>(steps_.size()); }
  /// Steps kept for repetitions.
  long checkpoints() const { return segment_ > 0 ? (steps() + segment_ - 1) / segment_ : 0; }
  /// The jumps behind step k, the last one first, are jump(jumps_end(k) - 1) down to jump(jumps_begin(k)).
  std::size_t jumps_begin(long k) const { return step(k).jumps; }
  std::size_t jumps_end(long k) const { return k + 1 < steps() ? step(k + 1).jumps : jumps_.size(); }
  const Jump& jump(std::size_t i) const { return jumps_[i].jump; }

 protected:
  struct Step {
    double t, h, t_end;
    int mode;
    std::size_t jumps;             // number of jumps before it ends
    std::vector<double> y;         // at its start, where the repetitions of a segment begin with that
    std::unique_ptr<double[]> at;  // its stages, where they are kept
  };

  /// segment_steps: K, or 0 for one that follows from `bytes`, once stages do not fit.
  StepTape(double bytes, long segment_steps) : bytes_(bytes), segment_(segment_steps) {}

  /// `entries`: numbers that are kept of a step.
  void set_budget(std::size_t entries) {
    const double of_step = static_cast<double>(sizeof(double) * entries + sizeof(Step) + 2 * sizeof(void*));
    budget_ = static_cast<std::size_t>(std::max(2.0, bytes_ / of_step));
  }
  /// Whether one more step does not fit.
  bool full() const { return segment_ == 0 && steps_.size() >= budget_; }
  /// Whether one more step does not fit: from here on there are segments. Those who keep stages drop what they need
  /// not.
  bool begins_segments() {
    if (!full()) return false;
    segment_ = static_cast<long>(std::max<std::size_t>(1, budget_ / 2));
    return true;
  }
  bool in_segments() const { return segment_ > 0; }
  bool is_checkpoint(long k) const { return segment_ > 0 && k % segment_ == 0; }
  /// The checkpoint from which step k is repeated.
  long checkpoint_of(long k) const { return k / segment_ * segment_; }

  Step& step(long k) { return steps_[static_cast<std::size_t>(k)]; }
  const Step& step(long k) const { return steps_[static_cast<std::size_t>(k)]; }
  void add(Step step) {
    step.jumps = jumps_.size();
    steps_.push_back(std::move(step));
  }
  /// The state with which step k > 0 began, where a jump lies before it; else null.
  const std::vector<double>* jumped_to(long k) const {
    return jumps_end(k - 1) > jumps_begin(k - 1) ? &jumps_[step(k).jumps - 1].y_after : nullptr;
  }
  /// Step k is at hand: those behind it have served.
  void drop_behind(long k) {
    if (k + 1 < steps()) step(k + 1).at.reset();
  }

 private:
  struct Crossing {
    Jump jump;
    std::vector<double> y_after;
  };

  double bytes_;
  std::size_t budget_ = 0;  // in steps
  long segment_;
  std::vector<Step> steps_;
  std::vector<Crossing> jumps_;
};

}  // namespace costate
