// An element's own entries of a state, for evaluations beside the assembler's.
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class GatheredState {
 public:
  /// (t, q, v) of the element, its numbers from all `numbers`; valid until it is called again.
  LocalState of(const Element& element, const StateView& s, const std::vector<double>& numbers) {
    p_.resize(element.numbers().size());
    for (std::size_t i = 0; i < p_.size(); ++i) p_[i] = numbers[static_cast<std::size_t>(element.numbers()[i])];
    return with(element, s, p_.data());
  }
  /// The same with the element's own numbers (np).
  LocalState with(const Element& element, const StateView& s, const double* p) {
    const auto& c = element.coordinates();
    for (std::size_t i = 0; i < c.size(); ++i) {
      q_[i] = s.q[c[i]];
      v_[i] = s.v[c[i]];
    }
    return {.t = s.t, .q = q_, .v = v_, .p = p};
  }

 private:
  double q_[kMaxLocal], v_[kMaxLocal];
  std::vector<double> p_;
};

}  // namespace costate
