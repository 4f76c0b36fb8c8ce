// The course over a step of a force that is a function of where the motion is (path_watch.h): of a formula, or of a law
// of an element's deformation. It is looked at where the function's own terms pass through zero and its tables'
// arguments their knots, towards these from both sides, and in between, more often where something turns by more than a
// radian; and the step is halved into cells until on each the cubic through four of its values meets the others.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/law/cubic_check.h"
#include "costate/element/law/formula_law.h"
#include "costate/element/law/motion_law.h"
#include "costate/event/step_motion.h"
#include "costate/objective/own_value.h"

namespace costate {

/// Of a function with a cubic to each side of the only place that a step passes: what a method of many steps sees in
/// its next one, and what leaves a scheme of order two its order.
enum class LeftBends { none, of_rates, all };

class PathCourse {
 public:
  /// The values of a formula's arguments at a state.
  using Arguments = std::function<void(const StateView& s, Assembly& assembly, double* x)>;

  /// `coordinates`: those that its arguments depend on; `solved`: of accelerations and multipliers, too, which are
  /// asked for at each look.
  PathCourse(const Element& element, const FormulaLaw& formula, std::vector<int> coordinates, Arguments arguments,
             bool solved = false);
  /// A law of the element's deformation, or of its rate, with where it is sharp, and whether something may hide in
  /// between.
  PathCourse(const Element& element, const MotionLawElement& of, const MotionLaw& law, std::vector<double> sharp,
             bool search);

  /// What a user wrote, of which no place is known: it is looked at evenly, `often` times a second where it asks for
  /// the time or has been the same so far, and a few times a step else.
  PathCourse(const Element& element, std::vector<int> coordinates, OwnValue value, double often);

  const Element& element() const { return *element_; }

  /// A cell of a step, in parts of it, with how far the function is at most from its value at the step's beginning.
  struct Cell {
    double from, to, away;
  };
  /// By how much of what it changes the function may be off a cubic, and what part of its range in the run so far, or
  /// of its impulse, is nothing; which single bends are left to the integrator.
  struct Precision {
    double off, floor;
    LeftBends bends = LeftBends::of_rates;
  };
  /// Empty where a cubic is the whole step's course; or, of bends that are left to the integrator, as they are in the
  /// function's value at the step's end, one to each side of the only place that the step passes.
  /// `at` gives the states of the step that `motion` holds.
  const std::vector<Cell>& cells(StepMotion& motion, const GapTrace::States& at, Assembly& assembly,
                                 const Precision& precision);
  /// The part of the step, from its beginning, to which that goes: of one that turns by very much only so far.
  double looked_at() const { return looked_at_; }
  /// What is less, over this part of the step, is nothing: a force that was large for an instant hides no lasting one.
  /// And so is what moves nothing in so short a time: around the place at which a law leaves zero its course looks the
  /// same at every scale, down to rounding.
  double nothing(double part) const {
    return std::max({floor_, moves_nothing_ / part, std::min(no_range_, no_impulse_ / part)});
  }

  /// The step was taken.
  void record(double from, double to);
  /// Steps in which most changed, of itself or by its impulse: from, to.
  template <class Emit>
  void active(double part, const Emit& emit) const {
    double largest = 0, hardest = 0;
    for (const Change& s : steps_) {
      largest = std::max(largest, s.range);
      hardest = std::max(hardest, s.impulse());
    }
    const auto counts = [&](const Change& s) { return s.range > part * largest || s.impulse() > part * hardest; };
    for (std::size_t k = 0; k < steps_.size();) {
      if (!counts(steps_[k])) {
        ++k;
        continue;
      }
      const double from = steps_[k].from;
      for (; k < steps_.size() && counts(steps_[k]); ++k) continue;
      emit(from, steps_[k - 1].to);
    }
  }

 private:
  struct Sample {
    double u, f;
  };
  struct Change {
    double from, to, range;
    double impulse() const { return range * (to - from); }
  };

  /// At a part u of the step; look() with the terms in `terms_`.
  double value(double u);
  double look(double u);
  double value_here() const;
  void set_arguments(double u);
  void add(double u);
  /// Whether a law passes none of the places where it is sharp, or one of its bends that is left to the integrator.
  bool is_between_places(LeftBends leaves);
  /// The first looks, as many as something turns for, or as a user's function is to have.
  void look_along();
  void look_at_parts(int parts);
  int parts_of_own();
  void meet_arguments();
  /// Whether any argument changes by more than rounding between these.
  bool moves() const;
  /// By how much argument i may change and be rounding, of a motion of this size; and what such rounding, and that of
  /// the formula's terms, may make of it.
  double still(std::size_t i, double size) const;
  double noise(double u, double size);
  /// Where terms pass through zero and tables' arguments their knots.
  void find_places();
  void add_towards_places();
  bool is_cubic();
  bool is_bend();
  /// The impulse of a force that velocities do not feel, or of a cost that psi does not.
  double unfelt_impulse() const;
  /// Through four values between two places, compared with the samples there; and whether it does.
  CubicCheck cubic_over(double a, double b);
  bool is_met(const CubicCheck& cubic, double part) const {
    return cubic.off() <= std::max(off_ * cubic.range(), nothing(part));
  }
  void halve(double a, double b, int depth);
  void refine(double a, double b, int depth);

  const Element* element_;
  Arguments arguments_;                      // of a formula of many; else a law
  const MotionLawElement* owner_ = nullptr;  // of this element's deformation, with its
  int first_ = -1, origin_ = -1;             // numbers and its origin there; or
  bool of_rate_ = false;                     // of the deformation's rate
  const ScalarLaw* law_ = nullptr;
  const FormulaLaw* formula_ = nullptr;  // of either
  OwnValue own_;
  double often_ = 0;
  std::optional<bool> asks_for_time_;
  StateView own_here_;
  std::vector<double> sharp_;  // of a law of a deformation
  bool search_ = false;
  std::vector<int> coordinates_;
  bool solved_ = false;
  StepMotion* motion_ = nullptr;  // of the step that is looked at
  const GapTrace::States* at_ = nullptr;
  Assembly* assembly_ = nullptr;
  double x_here_ = 0, rate_here_ = 0;
  std::vector<double> here_, least_, most_;  // of the arguments, the variable behind them
  FormulaTerms terms_;
  std::vector<double> looks_;
  std::vector<FormulaTerms> first_terms_;  // at these
  std::vector<double> places_, course_, knots_;
  std::vector<Sample> samples_;
  std::vector<Cell> cells_;
  double looked_at_ = 1, off_ = 0, low_ = std::numeric_limits<double>::infinity(), high_ = -low_, low_now_ = 0,
         high_now_ = 0, floor_ = 0, no_range_ = 0, no_impulse_ = 0, moves_nothing_ = 0, impulse_ = 0, impulse_now_ = 0;
  std::vector<Change> steps_;
};

}  // namespace costate
