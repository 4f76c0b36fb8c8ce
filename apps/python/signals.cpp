#include "signals.h"

#include <chrono>
#include <csignal>
#include <mutex>

#include "costate/base/stop.h"

namespace costate::python {

namespace {

namespace py = pybind11;

/// What Python raised while a computation of this thread ran.
thread_local std::unique_ptr<py::error_already_set> raised;

[[noreturn]] void end_the_computation() { throw Interrupted(SIGINT); }

}  // namespace

void with_lock(const std::function<void()>& f) {
  py::gil_scoped_acquire lock;
  try {
    f();
  } catch (py::error_already_set& e) {
    raised = std::make_unique<py::error_already_set>(e);
  }
  if (raised) end_the_computation();
}

void check_signals() {
  using Clock = std::chrono::steady_clock;
  static thread_local Clock::time_point last;
  const auto now = Clock::now();
  if (now - last < std::chrono::milliseconds(50)) return;
  last = now;
  with_lock([] {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  });
}

Monitor signal_monitor() {
  return [](double, long, bool) { check_signals(); };
}

void run_unlocked(const std::function<void()>& f) {
  raised.reset();
  set_stop_check(&check_signals);  // the tool's commands set their own behind them
  try {
    const py::gil_scoped_release unlocked;
    f();
  } catch (...) {
    if (!raised) throw;
  }
  // A command may have kept what it had and gone on to its end.
  if (raised) {
    const auto error = std::move(raised);
    throw py::error_already_set(*error);
  }
}

}  // namespace costate::python
