// Whether a gradient is what its tolerance promises. Local errors of the size of rtol usually leave psi and its
// gradient with errors of 1 to 200 rtol; where a motion makes more of them (a pendulum that tips over, a chain that
// whips, terms that cancel) no equation of the run itself says so. The same gradient at a hundred times the tolerance
// does, for half of the cost: where the two are further apart than such errors explain, it is computed once more at a
// tenth of the tolerance, and that result is taken. What is still apart then is said. A psi that is small against what
// absolute tolerances are made for gets smaller ones first.
#pragma once

#include <functional>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

using GradientRun = std::function<GradientResult(const Problem& problem)>;

/// How a method is looked at besides.
struct Looks {
  bool erratic =
      false;  // at a tenth of the tolerance in any case: errors do not fall as it does, two may agree by chance
  bool scheme = false;  // of Runge and Kutta's kind: not confirmed by a looser run that takes hardly fewer steps
};

/// The result of `run`, its known error widened by what the runs differ by, or a better one of the same at a tenth of
/// the tolerance (less where that takes the same steps); gives notice where even that is not known to some digits fewer
/// than rtol. Nothing is done where few digits are asked for (rtol above 1e-6). `sensitive` becomes true where the
/// motion makes more of small errors than usual, of whatever cause.
GradientResult confirmed(const Problem& problem, GradientResult result, const GradientRun& run, Looks looks = {},
                         bool* sensitive = nullptr);

/// What may make much of small errors: the motion, or of a gradient by an adjoint the way back along it.
const char* what_grows(const GradientResult& result);

/// What counts as psi's size: itself, or a millionth of its largest scaled derivative.
double size_of_psi(const Problem& problem, const GradientResult& result);

/// A psi, or what counts as its size, that is small against what absolute tolerances are made for has their errors,
/// whatever rtol is. Gives the problem such that errors of psi by them are a thousand rtol of it, or `part` of it where
/// that is given; false where they are that small as it is.
bool resolve_small_psi(Problem& problem, double psi_size, double part = 0);

/// The same of a result of `run`, where it changes by that what rtol promises: `result` and `problem` are those of the
/// smaller tolerances then, and notices are those of its run alone.
bool resolve_small_psi(Problem& problem, GradientResult& result, const GradientRun& run);

/// A psi of any size but 0, for a run that is to tell what one of a loose tolerance is worth: such that errors by
/// absolute tolerances are a tenth of it.
bool resolve_any_psi(Problem& problem, double psi_size);

}  // namespace costate
