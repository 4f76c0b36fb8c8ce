// Numbers that a scene leaves out and that are taken from others as it is read, such as a bar's length from its points.
// A gradient would hold them while the scene, read again, would not: what they are taken from cannot be a parameter
// until the scene writes them out (lib/README.md (0)).
#pragma once

#include <string>
#include <vector>

#include "costate/mechanism/builder.h"

namespace costate {

struct TakenNumber final : SharedPart {
  int number = -1;
  std::string written_as;        // what the scene would write in its place; empty: the number's own path
  std::vector<int> coordinates;  // whose first values it is taken from
  std::vector<int> numbers;      // the other numbers that it is taken from
};

/// The number `path`, with this value, is taken from first values of these coordinates and from these numbers; returns
/// its index. `written_as` is for numbers that only stand together, "hinge.A.axis_second = [...]".
int add_taken_number(MechanismBuilder& builder, const std::string& path, double value, std::vector<int> coordinates,
                     std::vector<int> numbers, NumberRule rule = NumberRule::any, const std::string& written_as = {});

/// The same of what a line's first position follows from.
template <class Point>
int add_number_of_line(MechanismBuilder& builder, const std::string& path, double value, const Point& from,
                       const Point& to, NumberRule rule = NumberRule::any) {
  std::vector<int> coordinates = from.coordinates(), numbers = from.numbers();
  coordinates.insert(coordinates.end(), to.coordinates().begin(), to.coordinates().end());
  numbers.insert(numbers.end(), to.numbers().begin(), to.numbers().end());
  return add_taken_number(builder, path, value, std::move(coordinates), std::move(numbers), rule);
}

}  // namespace costate
