// What points of a branch, and what is found along it, say of themselves.
#include <cmath>

#include "costate/cycle/branch.h"

namespace costate {

std::optional<bool> BranchPoint::stable() const {
  if (multipliers.empty()) return true;
  const double m = std::abs(multipliers.front());
  if (std::abs(m - 1) <= undecided) return {};
  return m < 1;
}

const char* name_of(BifurcationKind kind) {
  switch (kind) {
    case BifurcationKind::fold:
      return "fold";
    case BifurcationKind::branch_point:
      return "branch point";
    case BifurcationKind::flip:
      return "flip";
    case BifurcationKind::neimark_sacker:
      return "Neimark-Sacker";
  }
  return "";
}

}  // namespace costate
