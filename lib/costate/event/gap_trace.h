// The course of a gap g over a step of an integrator, by the step's dense output, from few looks. With V >= |g'|
// between two looks at a and b, at which g has one sign,
//   |g(a)| + |g(b)| > V (b - a):   it does not come to zero between them,
// and nothing more is looked at: a gap out of reach costs one look a step. Else it is halved until the body turns
// little within a part, and there the signs of g' show whether g has an extremum, which is then found. V is the largest
// of the speeds at both ends whatever the body is turned to (element/gap_element.h), and of what the ends tell of the
// way between them, with room for what integrators' error control leaves open. What is turned about its origin alone (a
// wheel above the ground) need not be followed around: the same is asked of what is clear in any position.
#pragma once

#include <functional>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/gap_element.h"
#include "costate/element/law/motion_law.h"

namespace costate {

class GapTrace {
 public:
  GapTrace(const Element& element, const GapElement& gaps, int i) : element_(&element), gaps_(&gaps), i_(i) {}
  /// Of a law of the element's deformation that begins to act at `begin` from the number `origin` on: a stop.
  GapTrace(const Element& element, const MotionLawElement& laws, int origin, LawBegin begin)
      : element_(&element), laws_(&laws), i_(origin), begin_(begin) {}
  const Element& element() const { return *element_; }
  /// Whether a force acts wherever the gap is below zero, with these states of the element.
  bool presses(const double* z) const { return !gaps_ || gaps_->gap_presses(i_, z); }

  /// Where the gap is below zero: what presses there, below zero where that would pull and is cut off. The states of s
  /// are the element's own.
  double force(const StateView& s, const Assembly& assembly) const;

  struct Look {
    double t = 0;
    GapMotion m;
  };
  Look look(const StateView& s, const Assembly& assembly) const;

  using States = std::function<StateView(double t)>;
  /// Between two looks, which become the first and the last of `looks`: more of them, in order of time, so that between
  /// neighbours the gap does not come to zero and back, and the deepest place of what is below zero is among them.
  void follow(const Look& from, const Look& to, const States& at, const Assembly& assembly,
              std::vector<Look>& looks) const;
  /// A time between two looks of different sign, near the zero between them (to a small part of their distance), on the
  /// first one's side.
  double zero(Look a, Look b, const States& at, const Assembly& assembly) const;

 private:
  void divide(const Look& a, const Look& b, double whole, const States& at, const Assembly& assembly,
              std::vector<Look>& looks) const;
  void find_extremum(Look a, Look b, const States& at, const Assembly& assembly, std::vector<Look>& looks) const;

  const Element* element_;
  const GapElement* gaps_ = nullptr;
  const MotionLawElement* laws_ = nullptr;  // one of the two
  int i_;
  LawBegin begin_ = {};
};

/// With |g(a)| + |g(b)|, the way that the largest speed would take and the way that the ends tell of: whether the gap
/// cannot come to zero between them.
bool is_out_of_reach(double both, double by_speed, double between);
/// Whether the gap cannot come to zero between these.
bool stays_away(const GapTrace::Look& a, const GapTrace::Look& b);

}  // namespace costate
