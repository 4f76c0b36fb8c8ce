// An element's dual numbers held against its own values: a derivative that its physics loses, as by value_of() of a
// number, is the same in all blocks, formulations and methods. And what a body's residual is taken to be,
// r = M(q) a - Q(q, v).
#pragma once

#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/mechanism/mechanism.h"

namespace costate {

/// The local arguments of one element.
struct ElementPlace {
  double t = 0;
  std::vector<double> q, v, a, lambda, z, p;
  LocalState view() const { return {t, q.data(), v.data(), a.data(), lambda.data(), z.data(), p.data()}; }
};

/// Calls f(k) of the element's numbers that are looked at, evenly: a table can have thousands.
template <class F>
void for_numbers(const Element& e, const F& f) {
  constexpr std::size_t kNumbers = 400;
  const std::size_t n = e.numbers().size(), stride = (n + kNumbers - 1) / kNumbers;
  for (std::size_t k = 0; k < n; k += stride) f(k);
}

class LostDerivative : public ModelError {
 public:
  using ModelError::ModelError;
};

/// Throw LostDerivative at an element's path where derivatives by dual numbers (of force(), phi(), residual()) are not
/// those of the values, by differences along directions in positions, velocities, states, numbers and time. Where
/// differences do not settle they tell nothing. Allowed: 1e-5 of either, and what rounding leaves.
void check_values(const Mechanism& m, const Body& e, const ElementPlace& x);
void check_values(const Mechanism& m, const Constraint& e, const ElementPlace& x);
void check_values(const Mechanism& m, const Force& e, const ElementPlace& x);

}  // namespace costate
