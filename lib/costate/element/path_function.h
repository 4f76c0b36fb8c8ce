// Forces that are formulas of where the motion is: like contacts they may act over a short part of what the motion
// travels, and integrators would step over that (event/path_watch.h).
#pragma once

#include "costate/element/element.h"
#include "costate/element/law/formula_law.h"
#include "costate/element/law/motion_law.h"

namespace costate {

/// An element of formulas, whose numbers begin with theirs: the laws that they call must not jump, as no other that the
/// motion travels (MotionLawElement). Where those bend formulas know (FormulaLaw::add_bends).
class FormulaElement {
 public:
  virtual ~FormulaElement() = default;
  virtual void add_formula_laws(std::vector<MotionLaw>& laws) const = 0;

 protected:
  static void add_laws_of(const FormulaLaw& formula, std::vector<MotionLaw>& laws) {
    for (const FormulaFunction& f : formula.functions())
      if (f.law) laws.push_back({f.law.get(), f.first, f.name});
  }
};

/// A force with such formulas is one of these as well.
class PathFunctionElement {
 public:
  virtual ~PathFunctionElement() = default;
  virtual int path_functions() const = 0;
  /// Of the time and its arguments.
  virtual const FormulaLaw& path_function(int i) const = 0;
  /// Those of the i-th at a state, path_function(i).number_count() of them: numbers, and behind them what moves.
  virtual void path_arguments(int i, const LocalState& s, double* x) const = 0;
};

}  // namespace costate
