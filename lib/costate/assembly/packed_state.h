// A state (q, v, z) in one array, as integrators, events and hand-derived equations store it, and as a view.
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

/// Of 2 n + nz numbers with n coordinates; valid as long as they are.
inline StateView packed_view(double t, const double* qvz, int n) {
  StateView s;
  s.t = t;
  s.q = qvz;
  s.v = qvz + n;
  s.z = qvz + 2 * n;
  return s;
}

inline std::vector<double> packed(const StateView& s, int n, int nz) {
  std::vector<double> qvz(s.q, s.q + n);
  qvz.insert(qvz.end(), s.v, s.v + n);
  qvz.insert(qvz.end(), s.z, s.z + nz);
  return qvz;
}

}  // namespace costate
