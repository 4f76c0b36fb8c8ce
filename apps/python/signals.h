// Ctrl-C from Python ends a run between its steps, as it does in the tool: Python's own handler is asked now and then,
// and what it raises (KeyboardInterrupt, or whatever a program has installed) comes out of the call.
#pragma once

#include <pybind11/pybind11.h>

#include "costate/problem/problem.h"
#include "costate/record/interrupt.h"

namespace costate::python {

/// Calls f without Python's lock. An exception that Python raised on the way (by a signal, in a callback) is raised.
void run_unlocked(const std::function<void()>& f);

/// Asks Python for signals, at most every 50 ms; throws Interrupted where there was one. Any thread, with or without
/// the lock.
void check_signals();

/// Calls f with the lock; what Python raises in it ends the computation: run_unlocked raises it again.
void with_lock(const std::function<void()>& f);

/// A monitor of runs that checks for signals.
Monitor signal_monitor();

}  // namespace costate::python
