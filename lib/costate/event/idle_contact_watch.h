// Rigid contacts that are closed and bear nothing, along a run. Where the normal force is zero all the time, as that of
// an upright wall that a body stands at, whatever pushes away opens the contact and whatever pushes towards it does not
// move the body: what is held has another derivative on either side, and equations know the one of their rows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/unilateral_force.h"

namespace costate {

class IdleContactWatch {
 public:
  explicit IdleContactWatch(const Mechanism& mechanism);

  /// Whether a state of this time and these z would tell anything: a contact is closed that has borne nothing yet.
  bool asks(const double* z) const;
  /// At states of the motion in order of time, with multipliers; what has opened by z is told apart from what holds.
  void look(const StateView& s, const Assembly& assembly);

  struct Idle {
    std::string contact;      // "contact.wall"
    double from = 0, to = 0;  // s
  };
  /// The first one that bore nothing from one look to another.
  const std::optional<Idle>& first() const { return first_; }

 private:
  struct Contact {
    const Force* force;
    int state, row;  // 1 in all states while it is closed; of its normal force among the multipliers
    bool closed = false, bears = false;
    double from = 0;
  };
  std::vector<Contact> contacts_;
  std::optional<Idle> first_;
};

}  // namespace costate
