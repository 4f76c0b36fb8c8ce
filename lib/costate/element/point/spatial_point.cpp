#include "costate/element/point/spatial_point.h"

#include <fmt/format.h>

#include "costate/base/error.h"

namespace costate {

std::vector<int> SpatialPoint::direction_coordinates() const {
  if (kind_ == Kind::free)
    throw ModelError("",
                     fmt::format("'{}' is a free point, to which no direction is fixed; a point of a body or of the "
                                 "ground is needed here.",
                                 name_));
  if (kind_ == Kind::ground) return {};
  return {coordinates_.begin() + 3, coordinates_.end()};
}

std::vector<int> SpatialPoint::rotation_coordinates() const {
  if (kind_ == Kind::on_natural_body)
    throw ModelError("", fmt::format("'{}' is on a body in natural coordinates, which this element does not know; make "
                                     "it a [rigid_body.*].",
                                     name_));
  return direction_coordinates();
}

}  // namespace costate
