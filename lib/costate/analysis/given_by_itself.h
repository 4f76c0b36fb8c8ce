// Positions that start as the scene has them although no one gave them: where nothing at all is given, those of points
// and bodies that no constraint touches (MechanismBuilder::build). An analysis that balances forces finds them instead.
#pragma once

#include "costate/mechanism/mechanism.h"

namespace costate {

inline bool given_by_itself(const GivenStart& g) { return g.coordinate >= 0 && g.name.empty(); }

}  // namespace costate
