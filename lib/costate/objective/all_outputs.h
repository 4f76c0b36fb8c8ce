// Every output of a mechanism at once, for files and lists; costs make the few that they need by name (output.h).
#pragma once

#include "costate/objective/output.h"

namespace costate {

/// In the order of output_names().
std::vector<std::unique_ptr<Output>> make_all_outputs(const Mechanism& mechanism);

}  // namespace costate
