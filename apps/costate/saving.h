// What a run that has ended still computes for its summary, which is short, is done after an interruption, too.
#pragma once

#include "costate/base/stop.h"
#include "costate/record/interrupt.h"

namespace costate::app {

/// While this lives, an interruption that has come ends no computation. (A second signal ends the process, as always.)
class Saving {
 public:
  Saving() { set_stop_check(nullptr); }
  ~Saving() { set_stop_check(&throw_if_interrupted); }
  Saving(const Saving&) = delete;
  Saving& operator=(const Saving&) = delete;
};

}  // namespace costate::app
