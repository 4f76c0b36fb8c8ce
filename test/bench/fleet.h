// Several uncoupled copies of a scene in one: the size of a problem grows and nothing else changes.
#pragma once

#include <string>

#include "costate/scene/scene.h"

namespace costate::bench {

/// `count` copies: every [kind.NAME] becomes [kind.vI_NAME], and so do the texts that are NAME or begin with "NAME.".
/// The start's lists and the cost's terms are those of all copies; gravity, [run] and [formulation] are shared;
/// parameters and constraints of an optimization are left out.
Scene make_fleet(const Scene& one, int count);

}  // namespace costate::bench
