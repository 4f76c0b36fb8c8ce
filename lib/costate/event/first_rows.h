// Where the rows of constraints begin, by the constraint: contacts know theirs by that.
#pragma once

#include <map>

#include "costate/mechanism/mechanism.h"

namespace costate {

inline std::map<const Constraint*, int> first_rows(const Mechanism& m) {
  std::map<const Constraint*, int> first;
  for (std::size_t i = 0; i < m.constraints().size(); ++i) first[m.constraints()[i].get()] = m.row_offsets()[i];
  return first;
}

}  // namespace costate
