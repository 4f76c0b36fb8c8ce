// Elements that know where their own equations end: a wheel that lies flat, a contact point that leaves its wheel. A
// run that gets no further asks each of them what it says of the state there.
#pragma once

#include <string>
#include <vector>

#include "costate/element/element.h"

namespace costate {

/// A body, constraint or force that can complain is one of these as well.
class ComplainingElement {
 public:
  virtual ~ComplainingElement() = default;
  /// Appends what is at its limit at this state (t, q, v, z), each as the rest of a sentence whose subject is the
  /// element: "lies flat (camber -87 degrees)".
  virtual void add_complaints(const LocalState& s, std::vector<std::string>& said) const = 0;
};

}  // namespace costate
