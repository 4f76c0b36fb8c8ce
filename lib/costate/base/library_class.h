// Whether a class is Costate's own: the tests hold the derivatives of all of these against oracles, so that a run need
// only look at a user's.
#pragma once

#include <string_view>
#include <typeinfo>

namespace costate {

/// By the mangled name (Itanium ABI): a class of namespace costate or of one within.
inline bool is_of_library(const std::type_info& type) {
  return std::string_view(type.name()).substr(0, 9) == "N7costate";
}

}  // namespace costate
