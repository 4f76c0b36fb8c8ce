// Where a law that tells nothing of it jumps, or its slope or curvature does: a formula's atan(tan(w t)), the kink of
// sqrt(t^2). What such a place depends on is in no derivative by dual numbers, and a driver's kink is a blow that no
// equation of accelerations holds. The law's course is searched as for steps (element/course.h), and within each of its
// cells the half that changes most is halved on, until what is left is a jump or nothing.
#pragma once

#include <vector>

#include "costate/element/law/scalar_law.h"

namespace costate {

struct HiddenJump {
  double x, left, right;
};
enum class JumpOf { value, slope, curvature };

/// Of f(rate (x - shift)) within from < x < to; none of laws that know their places.
class HiddenJumps {
 public:
  HiddenJumps(const ScalarLaw& law, const double* p, double from, double to, double shift = 0, double rate = 1);

  /// In order. Less than 1e-6 of what the law (its slope, its curvature) comes to there counts as none; what changes by
  /// more between two neighbouring numbers is one.
  std::vector<HiddenJump> of(JumpOf what) const;

 private:
  double known(double x, JumpOf what) const;

  const ScalarLaw& law_;
  const double* p_;
  double from_, to_, shift_, rate_;  // from_ < to_, of the law
  std::vector<double> ends_;         // of its cells, in order; empty where nothing is searched
};

}  // namespace costate
