// The way back of a DAE with hidden constraints (index 2 and 3), tried more than once where its steps were noise. The
// algebraic unknowns of such an adjoint are what a step makes of the differential ones' errors, divided by its length:
// once the error test fails for the error of a Newton iteration, or for the seam between two polynomials of the motion
// that was stored, a shorter step makes it worse. Steps then collapse to where the error test is fooled, and what is
// integrated is off by far more than the tolerance (seen: 1e5 rtol). It shows in error test failures: far more than the
// motion's own steps had, and than one in a hundred steps. Such a way is gone once more with another tolerance of
// Newton's iterations, until one has no more than usual or two agree.
#pragma once

#include <vector>

#include "costate/integrator/segment.h"
#include "costate/problem/problem.h"

namespace costate {

class AttemptsBack {
 public:
  struct Way {
    AdjointState mu;
    std::vector<double> gradient;
  };
  /// `most` is how many there are; all begin with the same.
  AttemptsBack(const ParameterSelection& parameters, const SolverOptions& options, int most, Way begin)
      : parameters_(parameters), options_(options), most_(most), begin_(std::move(begin)) {}

  Way begin() const { return begin_; }
  int number() const { return number_; }
  /// Within a handler: the attempt ended in an error, which is thrown again when it was the last and none came through.
  void failed();
  /// It came through; the counters before and after it.
  void add(Way way, const Counters& before, const Counters& after);
  /// Whether another one is needed; gives notice where none settled it.
  bool again();
  /// The one that is taken, after again() has said no.
  const Way& best() const { return best_; }

 private:
  double apart(const Way& a, const Way& b) const;

  const ParameterSelection& parameters_;
  const SolverOptions& options_;
  int most_, number_ = 0;
  Way begin_, best_;
  bool any_ = false, settled_ = false;
  long failures_ = 0, steps_ = 0;  // of the best
  double apart_ = 0;               // the last one that came through from the best before it; 0: there was none
};

}  // namespace costate
