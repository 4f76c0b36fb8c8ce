// Whether a class is Costate's own: the tests hold the derivatives of all of these against oracles, so that a run need
// only look at a user's.
#pragma once

#include <algorithm>
#include <string_view>
#include <typeinfo>

namespace costate {

/// By the mangled name (Itanium ABI): a class of namespace costate or of one within.
inline bool is_of_library(const std::type_info& type) {
  return std::string_view(type.name()).substr(0, 9) == "N7costate";
}

/// Whether all classes that it is a template of, if any, are of namespace costate (or std), too: AxialForce<a user's
/// law> is not.
inline bool is_wholly_of_library(const std::type_info& type) {
  if (!is_of_library(type)) return false;
  const std::string_view name = type.name();
  const auto digit = [&](std::size_t at) { return at < name.size() && name[at] >= '0' && name[at] <= '9'; };
  for (std::size_t i = 1; i < name.size();) {
    if (digit(i)) {  // a name, behind its length
      std::size_t length = 0;
      for (; digit(i); ++i) length = 10 * length + static_cast<std::size_t>(name[i] - '0');
      i += length;
    } else if (name[i] == 'L') {  // a number
      i = std::min(name.find('E', i), name.size() - 1) + 1;
    } else if (name[i] == 'S' && i + 1 < name.size() && name[i + 1] != 't') {  // what has been before
      i = std::min(name.find('_', i), name.size() - 1) + 1;
    } else if (name[i] == 'I' || name[i] == 'N' || name[i] == 'E') {
      // An argument with a name of its own, or of another namespace than what has been before: S_ is costate.
      const bool begins = name[i] != 'N', nested = i + 1 < name.size() && name[i + 1] == 'N';
      if (begins && (digit(i + 1) || (nested && name.substr(i + 2, 1) != "S"))) return false;
      ++i;
    } else {
      ++i;
    }
  }
  return true;
}

}  // namespace costate
