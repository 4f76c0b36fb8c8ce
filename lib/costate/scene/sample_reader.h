// [[cost.samples]]: the sum of squares over the times of a table of data.
#pragma once

#include "costate/scene/cost_kind.h"

namespace costate {

MakeCostTerm read_samples(SceneTable& table, MechanismBuilder& builder);

}  // namespace costate
