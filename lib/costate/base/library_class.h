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

/// Whether the class that it is a template of, if any, is one of namespace costate, too: AxialForce<a user's law> is
/// not. By the first argument of the template.
inline bool is_wholly_of_library(const std::type_info& type) {
  if (!is_of_library(type)) return false;
  std::string_view name = std::string_view(type.name()).substr(1);
  while (!name.empty() && name.front() >= '0' && name.front() <= '9') {
    std::size_t length = 0;
    for (; !name.empty() && name.front() >= '0' && name.front() <= '9'; name.remove_prefix(1))
      length = 10 * length + static_cast<std::size_t>(name.front() - '0');
    name.remove_prefix(std::min(length, name.size()));
  }
  // Of namespace costate once more: NS_; neither a name of its own nor one of another namespace.
  if (name.empty() || name.front() != 'I') return true;
  name.remove_prefix(1);
  const bool digit = !name.empty() && name.front() >= '0' && name.front() <= '9';
  return !digit && (name.substr(0, 1) != "N" || name.substr(0, 3) == "NS_");
}

}  // namespace costate
