// The smallest absolute tolerance that is accepted.
#pragma once

namespace costate {

/// Errors are measured by it and squared: (|y| / atol)^2 is to stay a number for every |y| below 1e50.
inline constexpr double kLeastAtol = 1e-100;

}  // namespace costate
