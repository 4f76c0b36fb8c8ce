// What contacts that may slide in space need beside those of the plane (element/switched_rows.h).
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "costate/element/force/rigid_contact.h"
#include "costate/event/contact_gap.h"

namespace costate {

/// Contact: has its force, contact and sliding_state.
template <class Contact>
bool slides_in_space(const Contact& c) {
  return c.sliding_state >= 0 && c.contact->row_count() == 3;
}

/// Its velocity along the ground, in space with the offset: w.
template <class Contact>
Eigen::VectorXd slip_of(const Contact& c, const StateView& s, const Assembly& assembly) {
  Eigen::VectorXd w(c.contact->row_count() - 1);
  for (int k = 0; k < w.size(); ++k)
    w[k] = row_of(*c.force, *c.contact, 1 + k, s, assembly, nullptr).c1 +
           (slides_in_space(c) ? s.z[c.sliding_state + 1 + k] : 0);
  return w;
}

/// Whether it slides from rest with the states `after`, and has not done so with those before.
template <class Contact>
bool slip_begins(const Contact& c, const double* before, const double* after) {
  if (after[c.closed_state] < 0.5 || after[c.sliding_state] < 0.5) return false;
  const double *offset = after + c.sliding_state + 1, *was = before + c.sliding_state + 1;
  return offset[0] != was[0] || offset[1] != was[1];
}

/// The offset of its velocity, behind the state `sliding` of z: none.
inline void clear_slip(int sliding, double* z) { z[sliding + 1] = z[sliding + 2] = 0; }

/// The same with which it begins to slide from rest along lambda_t, against the friction -lambda_t.
inline void offset_slip(int sliding, const double* lambda_t, double* z) {
  const double size = std::hypot(lambda_t[0], lambda_t[1]);
  for (int k = 0; k < 2; ++k) z[sliding + 1 + k] = size > 0 ? kSlidingOffset * lambda_t[k] / size : 0;
}

}  // namespace costate
