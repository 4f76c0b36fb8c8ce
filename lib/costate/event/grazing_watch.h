// Touches that are grazed, or missed by a hair, along a run. Where a gap falls to zero but would have turned round at a
// small depth without the touch, delta = g'^2/2g'' there, errors of that size decide whether it comes, and what comes
// of it has the derivative of a root of delta. Where it turns round above zero, delta is what was missing. Both count
// in parts of what the gap ranges over in the run, and only where it has come from afar: what settles on the ground
// lifts and touches by hairs all the time.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/gathered_state.h"
#include "costate/element/gap_element.h"
#include "costate/element/guarded_force.h"

namespace costate {

class GrazingWatch {
 public:
  explicit GrazingWatch(const Mechanism& mechanism);
  bool empty() const { return guards_.empty(); }

  /// At each step of a run, in order of time, with the numbers of the assembly.
  void look(const StateView& s, const Assembly& assembly);

  struct Place {
    double t = 0;
    std::string event;            // "contact.foot: touch"
    double depth = 0, range = 0;  // delta, and that of the gap
  };
  /// "contact.foot: touch", of what impacts within so many seconds as `s` has it, if anything does.
  std::optional<std::string> impact_within(double seconds, const StateView& s, const Assembly& assembly);
  /// The one of least depth in parts of the range, if there is any.
  std::optional<Place> nearest() const;

 private:
  struct Guard {
    const Force* force;
    const GuardedForce* guarded;
    const GapElement* gaps;
    int k, first_state;
    // Where it was open at the last look.
    double t = std::numeric_limits<double>::quiet_NaN(), gap = 0, rate = 0, turns = 0;  // turns: g'' before it
    double farthest = 0;                                                                // since it opened
    double least = std::numeric_limits<double>::infinity(), most = -std::numeric_limits<double>::infinity();
    struct At {
      double t, depth, farthest;
    };
    std::optional<At> shallowest = {};
  };
  static std::string name_of(const Guard& g);
  /// The force's state, and its gap there.
  std::pair<LocalState, GapMotion> motion_of(const Guard& g, const StateView& s, const Assembly& assembly);
  static void keep(Guard& g, double t, double depth);
  /// Where it has come to zero, or turned round, behind the last look.
  static void keep_expected(Guard& g);

  std::vector<Guard> guards_;
  GatheredState gathered_;
};

}  // namespace costate
