// Roll, pitch and yaw of a body in space, as vehicle people measure them: A = A_z(yaw) A_y(pitch) A_x(roll), so
//   yaw = atan2(A21, A11),   pitch = atan2(-A31, sqrt(A32^2 + A33^2)),   roll = atan2(A32, A33)    [rad].
// Yaw and roll lie within -pi .. pi; at a pitch of +-pi/2 they are not defined, and given as 0. Outputs only: no
// equation of motion uses them.
#pragma once

#include <cmath>

#include "costate/derivative/dual.h"

namespace costate {

enum class CardanAngle { roll, pitch, yaw };

/// atan2(y, x) on a differentiating scalar; 0 where both vanish.
template <class S>
S direction_angle(const S& y, const S& x) {
  using std::atan;
  const double y0 = value_of(y), x0 = value_of(x);
  if (x0 == 0 && y0 == 0) return S(0.0);
  const S angle = std::abs(x0) >= std::abs(y0) ? S(atan(y / x)) : S(-atan(x / y));
  return angle + S(std::atan2(y0, x0) - value_of(angle));  // by 0, +-pi/2 or +-pi
}

/// From the first column of the rotation matrix and the last two entries of its last row.
template <class S>
S cardan_angle(CardanAngle which, const S& A11, const S& A21, const S& A31, const S& A32, const S& A33) {
  using std::sqrt;
  switch (which) {
    case CardanAngle::roll:
      return direction_angle(A32, A33);
    case CardanAngle::pitch:
      return direction_angle(S(-A31), S(sqrt(A32 * A32 + A33 * A33)));
    case CardanAngle::yaw:
      break;
  }
  return direction_angle(A21, A11);
}

}  // namespace costate
