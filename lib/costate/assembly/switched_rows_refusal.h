// What formulations do not carry of rows that come and go with contacts that close (element/switched_rows.h).
#pragma once

#include "costate/assembly/assembly.h"

namespace costate {

/// Throws CapabilityError where rows that come and go have no place: for formulations of independent coordinates, which
/// hold a contact that sticks at the place where it is.
void refuse_rows_without_place(const Assembly& assembly);

}  // namespace costate
