// A copy of a state: views of one live in what made them, and are valid until that is asked for another.
#pragma once

#include <limits>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

struct OwnState {
  double t = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> q = {}, v = {}, a = {}, lambda = {}, z = {};

  /// What is not there (null) is empty.
  void take(const StateView& s, const Assembly& assembly) {
    const auto copy = [](std::vector<double>& to, const double* from, int count) {
      to.assign(from, from + (from ? count : 0));
    };
    t = s.t;
    copy(q, s.q, assembly.n());
    copy(v, s.v, assembly.n());
    copy(a, s.a, assembly.n());
    copy(lambda, s.lambda, assembly.m());
    copy(z, s.z, assembly.nz());
  }
  StateView view() const {
    const auto of = [](const std::vector<double>& x) { return x.empty() ? nullptr : x.data(); };
    return {t, of(q), of(v), of(a), of(lambda), of(z)};
  }
};

}  // namespace costate
