// What the kinds of forces along a line share: the same table serves planar and spatial points.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/element/force/axial_force.h"
#include "costate/element/force/with_work.h"
#include "costate/kind/lookup.h"

namespace costate {

/// A force between two points, planar or spatial, whose names are reported at path.from and path.to; one that
/// drives may report its work.
template <class Law>
void add_axial_force(MechanismBuilder& builder, const std::string& kind, const std::string& name, Law law,
                     const std::vector<int>& numbers, const std::string& from, const std::string& to,
                     bool with_work = false) {
  const std::string path = kind + "." + name;
  const auto add = [&]<class Line>(const Line& line) {
    using Axial = AxialForce<Law, Line>;
    if constexpr (requires { Law::drives; })
      builder.add(make_force<Axial>(with_work, kind, name, std::move(law), numbers, line));
    else
      builder.add(std::make_unique<Axial>(kind, name, std::move(law), numbers, line));
  };
  if (is_spatial(builder, from, to))
    add(find_spatial_line(builder, path, from, to));
  else
    add(find_line(builder, path, from, to));
}

}  // namespace costate
