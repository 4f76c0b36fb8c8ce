// Why there is no output NAME.work of something that reports its power.
#pragma once

#include <string>

#include "costate/mechanism/mechanism.h"

namespace costate {

/// A sentence behind a space, or nothing where `output` is not the work of such an element.
std::string work_hint(const Mechanism& mechanism, const std::string& output);

}  // namespace costate
