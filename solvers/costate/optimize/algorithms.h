// NLopt's algorithms by the names that scenes and the command line use; optimizer_algorithms() lists them.
#pragma once

#include <nlopt.hpp>
#include <string>

namespace costate {

/// Throws CapabilityError where there is no such algorithm, or it takes no constraints.
nlopt::algorithm algorithm_of(const std::string& name, bool constrained);

}  // namespace costate
