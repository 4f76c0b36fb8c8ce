// No exception crosses a C frame: callbacks run under a guard that keeps the exception and returns SUNDIALS'
// unrecoverable error; the caller rethrows it with its own type once the C function has returned. A StepError and a
// NotFinite are recoverable: the integrator tries a shorter step.
#pragma once

#include <cmath>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include "costate/analysis/not_finite.h"
#include "costate/base/error.h"

namespace costate {

/// A trial step that led to no number: what came of an earlier failure (a step too short to divide by), whose message
/// says more.
class NoNumber : public StepError {
 public:
  using StepError::StepError;
};

class CallbackGuard {
 public:
  /// 0 on success, 1 after a StepError (its message is kept) or a NotFinite (kept), -1 after any other exception
  /// (kept).
  template <class Function>
  int run(Function&& f) noexcept {
    try {
      std::forward<Function>(f)();
      return 0;
    } catch (const NoNumber& e) {
      try {
        if (last_step_error_.empty()) last_step_error_ = e.what();
      } catch (...) {  // no memory for the message
      }
      return 1;
    } catch (const StepError& e) {
      try {
        last_step_error_ = e.what();
      } catch (...) {  // no memory for the message
      }
      return 1;
    } catch (const NotFinite& e) {
      try {
        not_finite_.emplace(e);
      } catch (...) {  // no memory for it
      }
      return 1;
    } catch (...) {
      if (!error_) error_ = std::current_exception();
      return -1;
    }
  }
  /// The message of the last StepError, or empty.
  const std::string& last_step_error() const { return last_step_error_; }
  /// Throws the last NotFinite as a RunNotFinite with this report if it was met within `reach` s of t, where the
  /// integrator has given up: what it cannot step over.
  void throw_not_finite(double t, double reach, const std::string& report) const {
    if (not_finite_ && std::abs(not_finite_->t - t) <= reach) throw RunNotFinite(*not_finite_, report);
  }
  bool failed() const { return error_ != nullptr; }
  void rethrow() {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

 private:
  std::exception_ptr error_;
  std::string last_step_error_;
  std::optional<NotFinite> not_finite_;
};

}  // namespace costate
