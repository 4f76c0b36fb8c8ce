// What a backward pass needs of a discrete run: each step's record, and its factors as long as memory lasts. When the
// records themselves do not fit, only every K-th is kept and the steps between are computed again, segment by segment.
// All memory is taken at construction.
#pragma once

#include <memory>

#include "costate/discrete/discrete_scheme.h"

namespace costate {

class StepArchive {
 public:
  /// For `steps` steps of a started scheme, within `bytes`. segment_steps = 0: as many as fit.
  StepArchive(DiscreteScheme& scheme, long steps, double bytes, long segment_steps);

  /// Keeps the scheme's present step; to be called after start() and after each step().
  void keep();
  /// Makes step k present again, k falling from the last to 0; true when its factors are, too.
  [[nodiscard]] bool bring_back(long k);

  long segment_steps() const { return segment_; }
  /// Records kept along the way, apart from those of the present segment.
  long checkpoints() const { return (steps_ + segment_ - 1) / segment_; }
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
  std::unique_ptr<double[]> checkpoints_, records_, arena_;
  std::vector<Factors> factors_;
};

}  // namespace costate
