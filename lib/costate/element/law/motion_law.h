// Laws that the motion itself travels, along a length, an angle, a rate, a path or a road: where one of them jumps the
// force does, at an instant that moves with everything that moves the motion.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "costate/element/gap_element.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

struct MotionLaw {
  const ScalarLaw* law;
  int first;              // of its numbers among the element's
  std::string key;        // what the scene calls it in the element's table
  bool by_slope = false;  // whether the force holds the law's slope as well: then it jumps where the law has a kink
  double from = -std::numeric_limits<double>::infinity();  // joints before this do not count
  int origin = -1;       // of a law of x - origin, x the element's deformation(): that one of its numbers
  bool of_rate = false;  // of a law of the deformation's rate
  /// Whether its argument along a motion is known.
  bool followed() const { return origin >= 0 || of_rate; }
};

/// A force with such laws is one of these as well.
class MotionLawElement {
 public:
  virtual ~MotionLawElement() = default;
  virtual void add_motion_laws(std::vector<MotionLaw>& laws) const = 0;
  /// The deformation x that laws with an origin are taken of, with its rate and what bounds it, as of a gap to zero.
  virtual GapMotion deformation(const LocalState&) const { return {}; }
  /// Appends the times at which the force jumps by its laws of time, for the element's numbers p.
  virtual void add_force_jumps(const double*, std::vector<double>&) const {}
  /// The times at which the force's slope jumps by its laws of time: its derivative by what moves the time jumps there.
  virtual void add_force_bends(const double*, std::vector<double>&) const {}
  /// slopes[k] += dt/dp_k of such a time t.
  virtual void add_time_slopes(double, const double*, double*) const {}
};

/// Where pieces of a law meet: the law and its slope on both sides.
struct LawJoint {
  double x, left, right, left_slope, right_slope;
};
struct LawJoints {
  std::vector<LawJoint> all;
  double value = 0, slope = 0;  // the largest, there and between
  bool jumps(const LawJoint& joint) const;
  bool bends(const LawJoint& joint) const;
};
/// Where a law that is constant on one side begins to act, a stop; `sign` is that of the constant side.
struct LawBegin {
  double x, sign;
};
std::vector<LawBegin> law_begins(const ScalarLaw& law, const double* p);

/// Appends the places at which the law's value jumps, for its numbers p.
void add_value_jumps(const ScalarLaw& law, const double* p, std::vector<double>& x);

/// Those that the law knows of from `from` on, for its numbers p.
LawJoints law_joints(const ScalarLaw& law, const double* p, double from = -std::numeric_limits<double>::infinity());
/// Of a law of the element, with the mechanism's `numbers`.
LawJoints joints_of(const Element& element, const MotionLaw& law, const std::vector<double>& numbers);

}  // namespace costate
