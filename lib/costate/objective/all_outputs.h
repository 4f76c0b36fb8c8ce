// Many outputs of a mechanism at once, for files, lists and confirmations; costs make the few that they need by name
// (output.h).
#pragma once

#include "costate/objective/output.h"

namespace costate {

/// In the order of output_names().
std::vector<std::unique_ptr<Output>> make_all_outputs(const Mechanism& mechanism);

/// Those of these names, in their order, in one pass over the mechanism; throws like make_output.
std::vector<std::unique_ptr<Output>> make_outputs(const Mechanism& mechanism, const std::vector<std::string>& names);

}  // namespace costate
