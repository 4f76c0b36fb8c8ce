#include "costate/assembly/switched_rows_refusal.h"

#include <fmt/format.h>

#include "costate/base/error.h"

namespace costate {

void refuse_switched_rows(const Assembly& assembly) {
  if (!assembly.has_switched_rows()) return;
  const auto rows = assembly.mechanism().row_names();
  for (int i = 0; i < assembly.m(); ++i)
    if (!assembly.is_there(i))
      throw CapabilityError(fmt::format(
          "Row '{}' comes and goes with a contact that closes, which this formulation does not carry. Take index1, "
          "index2, baumgarte, penalty or augmented-lagrangian; or let the contact bounce for good (restitution above "
          "0, closing_speed_m_per_s = 0).",
          rows[static_cast<std::size_t>(i)]));
}

void refuse_spatial_friction(const Assembly& assembly, const std::string& who, const std::string& advice) {
  const auto& rows = assembly.slidable_rows();
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (rows[i].second == rows[i - 1].second)
      throw CapabilityError(fmt::format(
          "Row '{}' is friction of a rigid contact in space, which {} does not carry. Take {}; or friction = \"none\".",
          assembly.mechanism().row_names()[static_cast<std::size_t>(rows[i].first)], who, advice));
}

}  // namespace costate
