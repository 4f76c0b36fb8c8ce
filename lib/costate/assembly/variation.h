// A direction in the space of everything that a term of the equations depends on, for second derivatives: the
// change along it of a first derivative F_x is F_xq dq + F_xv dv + F_xa da + F_xlambda dlambda + F_xz dz +
// F_xrho drho (lib/README.md (13)), + F_xt dt along a motion in time.
#pragma once

namespace costate {

struct Variation {
  double t = 0;                                  // of time, where a term depends on it explicitly
  const double *q = nullptr, *v = nullptr;       // n each
  const double *a = nullptr, *lambda = nullptr;  // n, m, or null where the term depends on neither
  const double* z = nullptr;                     // nz
  const double* numbers = nullptr;               // of all numbers of the mechanism: what drho makes of them
};

}  // namespace costate
