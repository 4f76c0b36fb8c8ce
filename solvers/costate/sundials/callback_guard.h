// No exception crosses a C frame: callbacks run under a guard that keeps the exception and returns SUNDIALS'
// unrecoverable error; the caller rethrows it with its own type once the C function has returned. A StepError is
// recoverable: the integrator tries a shorter step.
#pragma once

#include <exception>
#include <string>
#include <utility>

#include "costate/base/error.h"

namespace costate {

class CallbackGuard {
 public:
  /// 0 on success, 1 after a StepError (its message is kept), -1 after any other exception (kept).
  template <class Function>
  int run(Function&& f) noexcept {
    try {
      std::forward<Function>(f)();
      return 0;
    } catch (const StepError& e) {
      try {
        last_step_error_ = e.what();
      } catch (...) {  // no memory for the message
      }
      return 1;
    } catch (...) {
      if (!error_) error_ = std::current_exception();
      return -1;
    }
  }
  /// The message of the last StepError, or empty.
  const std::string& last_step_error() const { return last_step_error_; }
  bool failed() const { return error_ != nullptr; }
  void rethrow() {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

 private:
  std::exception_ptr error_;
  std::string last_step_error_;
};

}  // namespace costate
