// What the kinds of forces along a line share: the same table serves planar and spatial points.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/element/force/axial_force.h"
#include "costate/kind/lookup.h"

namespace costate {

/// A force between two points, planar or spatial, whose names are reported at path.from and path.to.
template <class Law>
void add_axial_force(MechanismBuilder& builder, const std::string& kind, const std::string& name, Law law,
                     const std::vector<int>& numbers, const std::string& from, const std::string& to) {
  const std::string path = kind + "." + name;
  if (is_spatial(builder, from, to))
    builder.add(std::make_unique<AxialForce<Law, SpatialVector>>(kind, name, std::move(law), numbers,
                                                                 find_spatial_line(builder, path, from, to)));
  else
    builder.add(
        std::make_unique<AxialForce<Law>>(kind, name, std::move(law), numbers, find_line(builder, path, from, to)));
}

}  // namespace costate
