// Long computations of the library can be ended between their steps: the program says how it knows that it is to end
// (install_interrupt_handler in record/interrupt.h does, for Ctrl-C and SIGTERM).
#pragma once

#include <functional>

namespace costate {

/// `check` throws when the computation is to end; null: nothing ends it.
void set_stop_check(void (*check)());

/// Calls it. Cheap; any thread.
void check_stop();

/// Work that cannot call check_stop itself (a factorization, a parser): done by another thread, while this one waits
/// and checks. Throws what the work throws, or what the check throws; then the work goes on unheeded until the process
/// ends. `work` owns all that it reads and writes (by shared_ptr): what this thread has on its stack is gone by then.
void run_stoppably(std::function<void()> work);

}  // namespace costate
