// How far along its laws a motion goes: a spring's length, a damper's rate, a road under a wheel. Laws that tell where
// their pieces meet are looked at before a run (formulation/law_joins.h); one that does not, a formula's atan(tan(w
// x)), is searched for jumps where the motion has been: the instant at which it passes one is in no derivative.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/gathered_state.h"
#include "costate/element/course.h"
#include "costate/element/law/motion_law.h"

namespace costate {

class TravelledLaws {
 public:
  explicit TravelledLaws(const Mechanism& mechanism);
  bool empty() const { return laws_.empty() && tracks_.empty(); }

  /// At states (t, q, v) of the motion, with the numbers of the assembly.
  void look(const StateView& s, const Assembly& assembly);
  /// Of a jump that was passed: why no gradient is given, and what to do.
  std::optional<std::string> met(const Assembly& assembly) const;

 private:
  struct Range {
    double from = HUGE_VAL, to = -HUGE_VAL;
    void add(double x);
  };
  struct Law {
    const Force* force;
    const MotionLawElement* owner;
    MotionLaw law;
    Range range = {};
  };
  struct Track {
    const Force* force;
    const CourseElement* owner;
    int index;
    Range range = {};
  };
  std::vector<Law> laws_;
  std::vector<Track> tracks_;
  GatheredState gathered_;
};

}  // namespace costate
