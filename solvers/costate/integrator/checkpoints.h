// How an adjoint run keeps its forward motion for the way back: all steps in memory where they fit, otherwise some,
// with checkpoints from which SUNDIALS repeats a segment at a time.
#pragma once

#include "costate/formulation/system.h"
#include "costate/problem/problem.h"

namespace costate {

struct CheckpointPlan {
  long steps = 0;        // kept between two checkpoints
  bool repeats = false;  // whether segments are repeated; else a run of more steps must be made again with more
};

/// The user's number, or what a run at this tolerance is expected to take, within the memory budget. SUNDIALS
/// allocates two vectors for each step at once, so a number far too large costs time.
CheckpointPlan plan_checkpoints(const SolverOptions& options, int unknowns);
/// After a run of `steps` steps, more than were planned.
CheckpointPlan plan_again(const SolverOptions& options, int unknowns, long steps);
/// How many segments of a run may keep their steps at once, two at least: the budget is that of the whole run.
std::size_t segments_that_fit(const SolverOptions& options, int unknowns, const CheckpointPlan& plan);

/// Makes a repeated segment the same as the original, to the bit, or stops it. SUNDIALS relies on that: a repetition
/// that takes one step more than the original writes past the end of its arrays (up to 7.x). What a system carries from
/// one evaluation to the next (the pivots of its matrices) is therefore dropped throughout the first step of each
/// segment.
class RepeatWatch {
 public:
  RepeatWatch(System& system, const CheckpointPlan& plan) : system_(system), plan_(plan) {}
  /// By every forward callback that evaluates the system, with the number of steps taken so far. Throws SolverError.
  void forward(long steps);
  /// By every backward callback.
  void backward() { backward_ = true; }

 private:
  System& system_;
  CheckpointPlan plan_;
  bool backward_ = false, repeating_ = false;
  long first_ = 0;
};

}  // namespace costate
