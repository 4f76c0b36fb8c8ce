// The keys of laws, as reading their examples tells them.
#pragma once

#include "costate/kind/law/law_table.h"
#include "costate/scene/key_reference.h"

namespace costate {

std::vector<KeyEntry> law_keys(const LawKind& kind);

}  // namespace costate
