// What forces need of a BodyDirection besides its blocks, for every scalar that a force's physics is compiled
// for: how u changes along a velocity, and the generalized force of what acts along it.
#pragma once

#include "costate/element/point/body_direction.h"

namespace costate {

/// udot = u_q w.
template <class S>
void direction_rate(const BodyDirection& d, const S* q, const S* w, const S* s, S* u) {
  if (d.size() == 4) return rotated_rate(q, w, s, u);
  if (d.linear()) return d.value(w, s, u);
  for (int i = 0; i < 3; ++i) u[i] = S(0.0);
}

/// Q += u_q^T f.
template <class S>
void add_direction_force(const BodyDirection& d, const S* q, const S* s, const S* f, S* Q) {
  if (d.size() == 4) return add_rotated_force(q, s, f, Q);
  for (int k = 0; k < d.size() / 3; ++k)
    for (int i = 0; i < 3; ++i) Q[3 * k + i] += s[k] * f[i];
}

}  // namespace costate
