// Slips in space that are too slow to be told from an integrator's errors.
#pragma once

#include <algorithm>

namespace costate {

/// Of a slip with this largest speed since it began, where velocities are known to `relative` of it and `absolute`.
struct UnresolvedSlip {
  UnresolvedSlip(double largest, double relative, double absolute)
      : error(kErrors * (relative * largest + absolute)), part(kPart * largest) {}
  /// Slower it has no direction.
  double least() const { return std::min(error, part); }
  /// It has not been faster yet. One that has begun from rest then goes on where it would as soon as it has stopped:
  /// what it depends on has grown with time, it with the square of it.
  bool yet() const { return part < error; }

  // Ten errors; and of its largest speed, of which no slip is over before.
  static constexpr double kErrors = 10, kPart = 0.1;
  double error, part;
};

}  // namespace costate
