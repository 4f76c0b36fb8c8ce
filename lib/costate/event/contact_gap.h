// The gap of a rigid contact along the motion, and which contacts strike in one instant.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/unilateral_force.h"

namespace costate {

// What is as near to the ground and approaches it strikes at the same time, in lengths that the speed covers in a
// second, and no more than in ten of the mechanism's: corners that land flat come apart by what integrators are off by.
inline constexpr double kSimultaneous = 1e-8, kOfLengths = 10;

// A gap of this part of the coordinates is none.
inline constexpr double kGapRounding = 1e-10;
// What is within this part of the coordinates of the ground is at it: behind an event integrators go straight for a
// step, and are off by as much.
inline constexpr double kAtGround = 1e-7;

/// A contact's own number k, or 0 where it has none, k = -1. Contact: has force.
template <class Contact>
double contact_number(const Contact& c, int k, const Assembly& assembly) {
  return k < 0 ? 0 : assembly.numbers()[static_cast<std::size_t>(c.force->numbers()[static_cast<std::size_t>(k)])];
}

/// The largest of the force's own coordinates, by their levers (mechanism/length_size.h), which parts of the
/// coordinates are taken of.
inline double largest_coordinate(const Force& force, const StateView& s, const std::vector<double>& levers) {
  double largest = 0;
  for (const int c : force.coordinates())
    largest = std::max(largest, levers[static_cast<std::size_t>(c)] * std::abs(s.q[c]));
  return largest;
}

/// What a rigid contact's functions are taken of along the motion: coordinates with their first two derivatives in
/// time, the second for accelerations a, which may be null.
class ContactArguments {
 public:
  ContactArguments(const Force& force, const StateView& s, const Assembly& assembly, const double* a) {
    for (const int c : force.coordinates()) q_.emplace_back(Taylor2(s.q[c], s.v[c], a ? a[c] : 0));
    for (const int number : force.numbers()) p_.emplace_back(assembly.numbers()[static_cast<std::size_t>(number)]);
    arguments_.q = q_.data();
    arguments_.p = p_.data();
  }
  ContactArguments(const ContactArguments&) = delete;
  ContactArguments& operator=(const ContactArguments&) = delete;
  operator const MeasureArguments&() const { return arguments_; }

 private:
  std::vector<PathDual> q_, p_;
  MeasureArguments arguments_;
};

/// Row i of a rigid contact (element/unilateral_force.h), 0 for its gap, with its first two derivatives in time.
inline Taylor2 row_of(const Force& force, const UnilateralForce& contact, int i, const StateView& s,
                      const Assembly& assembly, const double* a) {
  return contact.row(i, ContactArguments(force, s, assembly, a)).v;
}

// What is at the ground and leaves it more slowly than this part of the speed of another impact is in its way.
inline constexpr double kHardlyLeaves = 1e-4;

/// The approach speed of an open contact that strikes together with one that does so at `speed`, else 0; next to
/// nothing where it is at the ground, and leaves it hardly. Contact: has force and contact. `length`: the mechanism's.
template <class Contact>
double strikes_too(const Contact& c, const StateView& s, const Assembly& assembly, double speed, double length) {
  // Not a number where the touch is not looked at.
  const Taylor2 gap = c.contact->guard(0, ContactArguments(*c.force, s, assembly, nullptr)).v;
  if (!(std::abs(gap.c0) < kSimultaneous * std::min(speed, kOfLengths * length)) || gap.c1 > kHardlyLeaves * speed)
    return 0;
  return std::max(-gap.c1, 1e-12 * speed);
}

}  // namespace costate
