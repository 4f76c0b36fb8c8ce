// Whether the end points of a force along a line pass through each other within a motion (element/meeting_ends.h). Its
// force jumps then. Steps over the jump end on its other side as if nothing had been, and no derivative knows of the
// instant at which it comes. Of each line d, from one look to the next: where it has turned round, its course between
// the looks is that of the cubic through both ends with their rates, and the ends meet where this comes as near to zero
// as rounding and the cubic's own error leave of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/gathered_state.h"
#include "costate/element/meeting_ends.h"

namespace costate {

class LineWatch {
 public:
  explicit LineWatch(const Mechanism& mechanism);
  bool empty() const { return lines_.empty(); }

  /// At states of the motion in order of time (positions and velocities), with the numbers of the assembly.
  void look(const StateView& s, const Assembly& assembly);
  /// Of the first that met: a sentence without its advice.
  std::optional<std::string> met() const;

 private:
  struct Line {
    const Force* force;
    const MeetingEnds* ends;
    double t = 0, d[3] = {}, rate[3] = {};
    bool seen = false;
  };
  struct Meeting {
    double t, jump;
    std::string force;
  };
  std::vector<Line> lines_;
  std::optional<Meeting> first_;
  GatheredState gathered_;
};

}  // namespace costate
