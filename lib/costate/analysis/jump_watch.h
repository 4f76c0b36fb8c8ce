// Whether a motion passes a place at which a force jumps, or of which it is to be told (element/jumping_force.h). A
// motion is right all the same; of what the instant depends on no derivative knows, and all methods agree on the same
// wrong gradient. Of each place, from one look to the next: on which side of it the motion is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/gathered_state.h"
#include "costate/element/jumping_force.h"

namespace costate {

class JumpWatch {
 public:
  /// `fixed_steps`: whether looks are the ends of steps that no error test makes short.
  explicit JumpWatch(const Mechanism& mechanism, bool fixed_steps = false);
  bool empty() const { return forces_.empty(); }

  /// At states of the motion in order of time (positions and velocities), with the numbers of the assembly.
  void look(const StateView& s, const Assembly& assembly);
  /// Of the first jump that was passed: why no gradient is given, and what to do.
  std::optional<std::string> met() const;
  /// What motions are told, a sentence each.
  const std::vector<std::string>& told() const { return told_; }

 private:
  struct Jumping {
    const Force* force;
    const JumpingForce* places;
    std::vector<JumpPlace> before = {};
    std::vector<char> told = {};
  };
  struct Jump {
    double t;
    std::string force;
    JumpPlace place;
  };
  bool fixed_steps_;
  std::vector<Jumping> forces_;
  std::optional<Jump> first_;
  std::vector<std::string> told_;
  std::vector<JumpPlace> now_;
  GatheredState gathered_;
};

}  // namespace costate
