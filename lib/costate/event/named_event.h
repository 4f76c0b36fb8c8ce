// The events of a mechanism by name, and what is to be known of one of them as outputs: its guard, and the states that
// its force has behind it. Sections of limit cycles are made of these.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/element/guarded_force.h"
#include "costate/mechanism/mechanism.h"
#include "costate/objective/output.h"

namespace costate {

struct NamedEvent {
  std::string name;  // "contact.left touch"
  const Force* force = nullptr;
  const GuardedForce* guarded = nullptr;
  int k = 0;            // of the force's own guards
  int first_state = 0;  // of the force, among all
  int direction = 1;    // +1 where the guard rises through zero
  int index = 0;        // among all events, as MotionEvents counts them
};

std::vector<std::string> event_names(const Mechanism& mechanism);
/// By name; a colon behind the force's path, as runs print it, may stand there. Throws ModelError with near names.
NamedEvent find_event(const Mechanism& mechanism, const std::string& name);

/// Of an event at which a force jumps and another one, in the same instant, that latches a speed: which of them comes
/// first decides what is latched, so that psi has two slopes there. A sentence, or nothing.
std::string kink_of_coincident(const Mechanism& mechanism, const std::string& first, const std::string& second);

// Both refer to the mechanism's force and must not outlive it.
/// The guard's value, NaN where it is not looked at.
std::unique_ptr<Output> make_guard_output(const NamedEvent& event);
/// The force's i-th own state behind the event, from everything before it.
std::unique_ptr<Output> make_output_behind(const NamedEvent& event, int i);

}  // namespace costate
