// A law of an argument that is itself differentiated, on every scalar that laws are compiled for.
#pragma once

#include "costate/derivative/dual.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

/// f(x) with the law's numbers p, of the same scalar or double.
inline double law_at(const ScalarLaw& law, double x, const double* p) { return law.value(x, p); }
inline PathDual law_at(const ScalarLaw& law, const PathDual& x, const PathDual* p) { return law.value(x, p); }
inline DirectedPathDual law_at(const ScalarLaw& law, const DirectedPathDual& x, const DirectedPathDual* p) {
  return law.value(x, p);
}
inline Dual<1> law_at(const ScalarLaw& law, const Dual<1>& x, const double* p) {
  const Dual<1> f = law.slope(x.v, p);
  return chain(x, f.v, f.d[0]);
}
inline Taylor2 law_at(const ScalarLaw& law, const Taylor2& x, const double* p) {
  const Taylor2 f = law.curve(x.c0, p);
  return compose(x, f.c0, f.c1, f.c2);
}

}  // namespace costate
