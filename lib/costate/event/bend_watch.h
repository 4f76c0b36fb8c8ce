// Where forces and running costs bend along a run whose derivative is wanted: the places at which pieces of a law of
// an element's deformation, or of its rate, meet with two slopes, and where abs, min and max of a formula do, or
// straight lines of a table that it holds, and where tyres and contacts touch or would pull. A step across such a place
// at which no stage feels much of it has next to no error, and yet a derivative that is off by the whole of its length
// times the jump of the slope: no estimate by values of the force tells. So the argument's course over each step is
// looked at, and the run passes the place with a step so short that its derivative does not count.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/law/motion_law.h"
#include "costate/event/gap_trace.h"
#include "costate/objective/objective.h"

namespace costate {

class BendWatch {
 public:
  /// Of the mechanism's forces and the running costs, with the numbers that the assembly has; what an argument moves by
  /// less than the integrator's tolerances is rounding. Formulas of accelerations or reactions are among them where the
  /// states that it is given have these.
  BendWatch(Assembly& assembly, const Objective& objective, double rtol, double atol, bool solved);

  bool empty() const { return sources_.empty(); }
  bool needs_accelerations() const { return accelerations_; }
  /// Of a step between these times whose error would do: where another one is to end instead, shortly before a place
  /// that it passes, or shortly behind it. `length` is that of steps nearby; `at` gives the state at times of the step.
  std::optional<double> passed(double from, double to, double length, const GapTrace::States& at);
  /// Of one whose derivative nobody wants: where it is to end instead, at the first place that it passes well within.
  std::optional<double> within(double from, double to, const GapTrace::States& at);
  struct Passage {
    std::size_t place;
    double t;
    bool beyond;  // from here on
  };
  /// The first time within a step at which a place is passed: just behind it, and before it by a billionth of the step.
  std::optional<double> first(double from, double to, const GapTrace::States& at);
  /// Calls met(passage) for each of them, in order.
  void each_passage(double from, double to, const GapTrace::States& at,
                    const std::function<void(const Passage& passage)>& met);
  static constexpr double kResolved = 1e-9;
  /// Whether a step of this length may lead across a place.
  bool across(double h) const { return h <= 1.01 * across_; }

 private:
  /// Of one element or formula: appends by how much arguments are beyond their places, as many at every state.
  struct Source {
    std::function<void(const StateView& s, std::vector<double>& beyond)> add;
    std::size_t first = 0;  // of its places among all
  };
  void look(const StateView& s, std::vector<double>& beyond);
  /// One of a step; others may come before it.
  std::optional<Passage> any_passage(double from, double to, const GapTrace::States& at);
  /// When this place is passed between two times at which it is on different sides.
  double passage(std::size_t place, double left, double right, double resolution, const GapTrace::States& at);
  /// The source of a place, and what it gives for it at a time.
  double look_again(std::size_t place, double t, const GapTrace::States& at);
  /// Where an argument that comes back within these three looks, `part` of a step apart, is on the other side; by less
  /// than that is rounding.
  std::optional<double> beyond_turn(std::size_t place, double left, double part, const double* looks, double least,
                                    const GapTrace::States& at);
  void add_laws(Assembly& assembly, const Element& force, const MotionLawElement& owner);

  double rtol_, atol_, across_ = 0;
  bool accelerations_ = false;
  std::vector<Source> sources_;
  // Of each place: the largest so far, and one source's.
  std::vector<double> largest_, own_;
  std::array<std::vector<double>, 5> looks_;  // over a step, evenly
};

}  // namespace costate
