// Whether somebody wants derivatives of the motions that a thread runs: what is to be said of these alone, as of a psi
// that has a kink, is no concern of a simulation.
#pragma once

namespace costate {

class DerivativesWanted {
 public:
  DerivativesWanted() { ++count_; }
  DerivativesWanted(const DerivativesWanted&) = delete;
  DerivativesWanted& operator=(const DerivativesWanted&) = delete;
  ~DerivativesWanted() { --count_; }

  /// Whether one lives in this thread.
  static bool by_anybody() { return count_ > 0; }

 private:
  static inline thread_local int count_ = 0;
};

}  // namespace costate
