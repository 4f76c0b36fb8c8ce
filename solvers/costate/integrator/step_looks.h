// The states at which a step was looked at last: its gaps are each halved at the same times, and the dense output of
// all states costs more than a look at one gap.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace costate {

/// State: a vector of one size.
template <class State>
class StepLooks {
 public:
  /// make(): a state of the right size.
  explicit StepLooks(std::function<State()> make) : make_(std::move(make)) {}
  /// Another step begins.
  void forget() { kept_ = next_ = 0; }
  /// The state at t, by interpolate(t, state); valid until kKept others have been asked for.
  template <class Interpolate>
  const State& at(double t, const Interpolate& interpolate) {
    for (std::size_t i = 0; i < kept_; ++i)
      if (times_[i] == t) return states_[i];
    const std::size_t place = next_;
    next_ = (next_ + 1) % kKept;
    if (states_.size() <= place) states_.push_back(make_());
    times_[place] = std::numeric_limits<double>::quiet_NaN();  // until it is there: interpolation may throw
    interpolate(t, states_[place]);
    times_[place] = t;
    kept_ = kept_ > place ? kept_ : place + 1;
    return states_[place];
  }

 private:
  static constexpr std::size_t kKept = 16;
  std::function<State()> make_;
  std::array<double, kKept> times_ = {};
  std::vector<State> states_;
  std::size_t kept_ = 0, next_ = 0;
};

}  // namespace costate
