// The gap of a rigid contact along the motion, and which contacts strike in one instant.
#pragma once

#include <cmath>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/unilateral_force.h"

namespace costate {

// What is as near to the ground and approaches it strikes at the same time, in lengths that the speed covers in a
// second.
inline constexpr double kSimultaneous = 1e-10;

/// The gap with its first two derivatives in time, the second for accelerations a; `looked_at`: NaN where the touch is
/// not looked at.
inline double gap_of(const Force& force, const UnilateralForce& contact, const StateView& s, const Assembly& assembly,
                     const double* a, Taylor2* along, bool looked_at = false) {
  std::vector<PathDual> q, p;
  for (const int c : force.coordinates()) q.emplace_back(Taylor2(s.q[c], s.v[c], a ? a[c] : 0));
  for (const int number : force.numbers()) p.emplace_back(assembly.numbers()[static_cast<std::size_t>(number)]);
  MeasureArguments x;
  x.q = q.data();
  x.p = p.data();
  const PathDual r = looked_at ? contact.guard(0, x) : contact.row(0, x);
  if (along) *along = r.v;
  return r.v.c0;
}

/// Row i of a rigid contact (element/unilateral_force.h) with its first two derivatives in time; a may be null.
inline Taylor2 row_of(const Force& force, const UnilateralForce& contact, int i, const StateView& s,
                      const Assembly& assembly, const double* a) {
  std::vector<PathDual> q, p;
  for (const int c : force.coordinates()) q.emplace_back(Taylor2(s.q[c], s.v[c], a ? a[c] : 0));
  for (const int number : force.numbers()) p.emplace_back(assembly.numbers()[static_cast<std::size_t>(number)]);
  MeasureArguments x;
  x.q = q.data();
  x.p = p.data();
  return contact.row(i, x).v;
}

/// The approach speed of an open contact that strikes together with one that does so at `speed`, else 0. Contact: has
/// force and contact.
template <class Contact>
double strikes_too(const Contact& c, const StateView& s, const Assembly& assembly, double speed) {
  Taylor2 gap;
  gap_of(*c.force, *c.contact, s, assembly, nullptr, &gap, true);
  return std::abs(gap.c0) < kSimultaneous * speed && -gap.c1 > 1e-9 * speed ? -gap.c1 : 0;
}

}  // namespace costate
