#include "costate/mechanism/number_rule.h"

#include <cmath>

namespace costate {

const char* violation(NumberRule rule, double x) {
  if (!std::isfinite(x)) return "must be finite";
  if (rule == NumberRule::positive && !(x > 0)) return "must be positive";
  if (rule == NumberRule::non_negative && !(x >= 0)) return "must not be negative";
  return nullptr;
}

}  // namespace costate
