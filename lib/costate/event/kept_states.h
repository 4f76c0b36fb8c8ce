// States within a step that guards are looked at, at some times again and again: each may cost a solution for
// accelerations and multipliers.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class KeptStates {
 public:
  using States = std::function<StateView(double)>;

  /// Of another step.
  void begin(const Assembly& assembly) {
    assembly_ = &assembly;
    for (Kept& k : kept_) k.t = std::numeric_limits<double>::quiet_NaN();
  }
  /// The state at t, which is kept with the one before.
  StateView keep(double t, const States& at) {
    for (const Kept& k : kept_)
      if (k.t == t) return k.view();
    Kept& k = kept_[next_ = 1 - next_];
    const StateView s = at(t);
    const auto copy = [](std::vector<double>& to, const double* from, int count) {
      to.assign(from, from + (from ? count : 0));
    };
    k.t = t;
    copy(k.q, s.q, assembly_->n());
    copy(k.v, s.v, assembly_->n());
    copy(k.a, s.a, assembly_->n());
    copy(k.lambda, s.lambda, assembly_->m());
    copy(k.z, s.z, assembly_->nz());
    return k.view();
  }
  /// One that is kept, or a new one by `at`, which is valid until that is called again.
  StateView operator()(double t, const States& at) const {
    for (const Kept& k : kept_)
      if (k.t == t) return k.view();
    return at(t);
  }

 private:
  struct Kept {
    double t = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> q = {}, v = {}, a = {}, lambda = {}, z = {};
    StateView view() const {
      const auto of = [](const std::vector<double>& x) { return x.empty() ? nullptr : x.data(); };
      return {t, of(q), of(v), of(a), of(lambda), of(z)};
    }
  };
  const Assembly* assembly_ = nullptr;
  Kept kept_[2];
  int next_ = 0;
};

}  // namespace costate
