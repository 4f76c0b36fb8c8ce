#include "costate/assembly/switched_rows_refusal.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/switched_rows.h"

namespace costate {

void refuse_rows_without_place(const Assembly& assembly) {
  const Mechanism& mech = assembly.mechanism();
  for (const std::size_t c : assembly.constraints_without_place()) {
    const auto* switched = dynamic_cast<const SwitchedRows*>(mech.constraints()[c].get());
    for (int i = 0; switched && i < mech.constraints()[c]->rows(); ++i)
      if (!switched->is_integrable(i))
        throw CapabilityError(
            fmt::format("Row '{}' of a sphere that rolls binds velocities alone, and its place depends on the way, "
                        "which independent coordinates do not tell. Take index1 or baumgarte, or kind = \"compliant\".",
                        mech.row_names()[static_cast<std::size_t>(mech.row_offsets()[c] + i)]));
  }
}

}  // namespace costate
