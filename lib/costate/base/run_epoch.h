// Which run this thread is at: what remembers the last state that it saw (angles that pass half a turn) begins anew
// with each.
#pragma once

namespace costate {

/// Another number in each run; find_start() raises it.
inline long& run_epoch() {
  thread_local long epoch = 0;
  return epoch;
}

}  // namespace costate
