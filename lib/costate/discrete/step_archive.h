// What a backward pass needs of a discrete run: each step's record, and its factors as long as memory lasts. When the
// records themselves do not fit, only every K-th is kept and the steps between are computed again, segment by segment.
// All memory is taken at construction, but for what cuts need (step_cut.h): records behind them, and checkpoints of
// runs that take more steps than expected.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "costate/discrete/discrete_scheme.h"

namespace costate {

class StepArchive {
 public:
  /// For some `steps` steps of a started scheme, within `bytes`. segment_steps = 0: as many as fit.
  StepArchive(DiscreteScheme& scheme, long steps, double bytes, long segment_steps);

  /// Keeps the scheme's present step; to be called after start() and after each step().
  void keep();
  /// The scheme has begun anew behind a cut.
  void keep_behind_cut();
  /// Makes step k present again, k falling from the last to 0; true when its factors are, too.
  [[nodiscard]] bool bring_back(long k);

  long segment_steps() const { return segment_; }
  /// Records kept along the way, apart from those of the present segment.
  long checkpoints() const {
    return std::max((steps_ + segment_ - 1) / segment_, static_cast<long>(checkpoints_.size()));
  }
  double bytes() const;

 private:
  struct Factors {
    StepMatrices::Saved saved;
    std::size_t offset = 0;
    bool kept = false;
  };
  double* slot(long k) { return records_.get() + static_cast<std::size_t>(k - 1 - first_) * record_size_; }

  DiscreteScheme& scheme_;
  long steps_, segment_ = 0, first_ = 0;  // the present segment holds the steps first_ + 1 ... first_ + segment_
  std::size_t record_size_, arena_size_ = 0, arena_used_ = 0;
  /// By how much the number of step k is ahead of its place among steps of one length.
  long ahead_before(long k) const;
  /// The scheme takes step k again.
  void step_again(long k);

  std::vector<std::unique_ptr<double[]>> checkpoints_;
  std::unique_ptr<double[]> records_, arena_;
  struct Length {
    double h, t_end;
  };
  std::map<long, Length> lengths_;              // of steps that are not as long as others
  std::map<long, long> ahead_;                  // from a step on: how many of these there were before
  std::map<long, std::vector<double>> behind_;  // by the step that ends there, the last of those in its instant
  long last_ = 0;
  std::vector<Factors> factors_;
};

}  // namespace costate
