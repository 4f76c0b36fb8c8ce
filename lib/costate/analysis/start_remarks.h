// What a start that was found is not, though the scene may have meant it.
#pragma once

#include <string>
#include <vector>

#include "costate/analysis/start.h"

namespace costate {

/// One sentence for each coordinate (the three that differ most) that the assembly moved far from its first guess: by
/// more than half of the mechanism's extent, or 90 degrees, for each body that it turned by more than that, or by 15
/// degrees from an orientation that the scene has; and for each (three at most) whose rate the scene has,
/// while the given ones make it another. Not for starts that balance forces, which the guess does not mean.
std::vector<std::string> start_remarks(const Assembly& assembly, const Start& start);

}  // namespace costate
