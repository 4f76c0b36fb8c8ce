// The time at which something that held along a step does not hold any more.
#pragma once

namespace costate {

/// In [a, b], holds(a) and not holds(b): both ends are moved to the change, until they are `within` apart or
/// neighbours.
template <class Holds>
void halve_to_change(double& a, double& b, double within, const Holds& holds) {
  while (b - a > within) {
    const double m = 0.5 * (a + b);
    if (m <= a || m >= b) break;
    (holds(m) ? a : b) = m;
  }
}

}  // namespace costate
