// What a number of a scene may be; every number is finite.
#pragma once

namespace costate {

enum class NumberRule { any, positive, non_negative };

/// Null when x obeys the rule, else what is wrong with it: "must be positive".
const char* violation(NumberRule rule, double x);

}  // namespace costate
