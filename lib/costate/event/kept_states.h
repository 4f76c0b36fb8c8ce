// States within a step that guards are looked at, at some times again and again: each may cost a solution for
// accelerations and multipliers.
#pragma once

#include <functional>
#include <limits>

#include "costate/assembly/own_state.h"

namespace costate {

class KeptStates {
 public:
  using States = std::function<StateView(double)>;

  /// Of another step.
  void begin(const Assembly& assembly) {
    assembly_ = &assembly;
    for (OwnState& k : kept_) k.t = std::numeric_limits<double>::quiet_NaN();
  }
  /// The state at t, which is kept with the one before.
  StateView keep(double t, const States& at) {
    for (const OwnState& k : kept_)
      if (k.t == t) return k.view();
    OwnState& k = kept_[next_ = 1 - next_];
    k.take(at(t), *assembly_);
    k.t = t;
    return k.view();
  }
  /// One that is kept, or a new one by `at`, which is valid until that is called again.
  StateView operator()(double t, const States& at) const {
    for (const OwnState& k : kept_)
      if (k.t == t) return k.view();
    return at(t);
  }

 private:
  const Assembly* assembly_ = nullptr;
  OwnState kept_[2];
  int next_ = 0;
};

}  // namespace costate
