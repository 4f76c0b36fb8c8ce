// f(x) for any scalar type from the values of f and its derivatives at value_of(x): what a law needs that
// computes its derivatives itself (a sum of many sines, a table) instead of by its template.
#pragma once

#include <utility>

#include "costate/derivative/dual.h"

namespace costate {

/// f[k] is the k-th derivative; the order that the type carries must be there: 1 for Dual<N>, 2 for Taylor2,
/// 3 for PathDual, 4 for DirectedPathDual.
inline double from_derivatives(double, const double* f) { return f[0]; }
inline Taylor2 from_derivatives(const Taylor2& x, const double* f) { return compose(x, f[0], f[1], f[2]); }
template <int N, class T>
Dual<N, T> from_derivatives(const Dual<N, T>& x, const double* f) {
  return chain(x, T(from_derivatives(x.v, f)), T(from_derivatives(x.v, f + 1)));
}

/// How many derivatives a type carries.
template <class S>
struct DerivativeOrder;
template <>
struct DerivativeOrder<double> {
  static constexpr int value = 0;
};
template <>
struct DerivativeOrder<Taylor2> {
  static constexpr int value = 2;
};
template <int N, class T>
struct DerivativeOrder<Dual<N, T>> {
  static constexpr int value = 1 + DerivativeOrder<T>::value;
};

}  // namespace costate
