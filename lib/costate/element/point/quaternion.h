// Products of quaternions w = (w0, w1, w2, w3), which Euler parameters are: A(a b) = A(a) A(b).
#pragma once

#include "costate/element/point/rotation.h"

namespace costate {

/// out = a b; must not be a or b.
template <class S>
void quaternion_product(const S* a, const S* b, S* out) {
  out[0] = a[0] * b[0] - dot3(a + 1, b + 1);
  cross3(a + 1, b + 1, out + 1);
  for (int i = 1; i < 4; ++i) out[i] += a[0] * b[i] + b[0] * a[i];
}

template <class S>
void quaternion_conjugate(const S* a, S* out) {
  out[0] = a[0];
  for (int i = 1; i < 4; ++i) out[i] = -a[i];
}

/// out = conj(a) b: of two frames, the second seen from the first.
template <class S>
void quaternion_difference(const S* a, const S* b, S* out) {
  S c[4];
  quaternion_conjugate(a, c);
  quaternion_product(c, b, out);
}

}  // namespace costate
