#include "costate/scene/parameter_start.h"

#include <fmt/format.h>

#include "costate/base/notice.h"
#include "costate/mechanism/parameter_bounds.h"

namespace costate {

void check_start(const Parameter& p, double start, const SceneNode& root, const std::string& number,
                 const SceneTable& table) {
  if (const double x = rounded_to_bounds(p, start); x >= p.lower && x <= p.upper) return;
  const SceneNode* found = find_node(root, number);
  const bool below = start < p.lower;
  if (found != nullptr && found->where.file.starts_with("override "))
    notice(fmt::format("Parameter '{}' starts at {}, {} its {} bound {} for optimization.", p.name, start,
                       below ? "below" : "above", below ? "lower" : "upper", below ? p.lower : p.upper));
  else if (below)
    table.fail("lower", fmt::format("is {}, above the start value {}.", p.lower, start));
  else
    table.fail("upper", fmt::format("is {}, below the start value {}.", p.upper, start));
}

}  // namespace costate
