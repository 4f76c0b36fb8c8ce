// Where forces and running costs bend along a run whose derivative is wanted: the places at which pieces of a law of an
// element's deformation, or of its rate, meet with two slopes, and where abs, min and max of a formula do. A step
// across such a place at which no stage feels much of it has next to no error, and yet a derivative that is off by the
// whole of its length times the jump of the slope: no estimate by values of the force tells. So the argument's course
// over each step is looked at, and the run passes the place with a step so short that its derivative does not count.
#pragma once

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
  /// less than the integrator's tolerances is rounding.
  BendWatch(Assembly& assembly, const Objective& objective, double rtol, double atol);

  bool empty() const { return places_.empty(); }
  /// Of a step between these times whose error would do: where another one is to end instead, shortly before a place
  /// that it passes, or shortly behind it. `length` is that of steps nearby; `at` gives the state at times of the step.
  std::optional<double> passed(double from, double to, double length, const GapTrace::States& at);
  /// Whether a step of this length may lead across a place.
  bool across(double h) const { return h <= 1.01 * across_; }

 private:
  struct Place {
    std::function<double(const StateView& s)> beyond;  // by how much the argument is beyond the place
    double largest = 0;                                // of that so far
  };
  /// The first time at which a place is passed, to a small part of the step.
  std::optional<double> first(double from, double to, const GapTrace::States& at);
  /// When this place is passed between two times at which it is on different sides.
  double passage(const Place& place, double left, double right, double resolution, const GapTrace::States& at) const;
  void add_laws(Assembly& assembly, const Element& force, const MotionLawElement& owner);

  double rtol_, atol_, across_ = 0;
  std::vector<Place> places_;
  std::vector<double> begin_, now_, end_;  // of each place: two looks and the step's end
};

}  // namespace costate
