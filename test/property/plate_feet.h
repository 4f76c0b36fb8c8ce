// The feet of a plate in space, as text of a scene.
#pragma once

#include <fmt/format.h>

#include <string>

namespace costate::test {

/// Point p<i> of the plate, and c<i>, its rigid contact with rough ground, closed at the start; `more`: lines of its
/// own.
inline std::string foot_of_plate(std::size_t i, double x, double y, double z, double friction,
                                 const std::string& more = "") {
  return fmt::format(
      "[point.p{0}]\non = \"plate\"\nx_m = {1}\ny_m = {2}\nz_m = {3}\n"
      "[contact.c{0}]\nkind = \"rigid\"\npoint = \"p{0}\"\nclosed = true\n"
      "friction = \"coulomb\"\nfriction_coefficient = {4}\n{5}",
      i, x, y, z, friction, more);
}

}  // namespace costate::test
