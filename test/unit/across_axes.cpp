// The direction that a joint's rows are taken across an axis by: well across it, and the same beside every axis that
// scenes are written with, as multipliers belong to it.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "costate/element/point/body_direction.h"

using namespace costate;

TEST_CASE("across axes: the same direction beside an axis along a coordinate, and well across any") {
  for (int i = 0; i < 3; ++i)
    for (const double sign : {-2.0, 1.0}) {
      Vector3 axis = Vector3::Zero();
      axis[i] = sign;
      for (int j = 0; j < 3; ++j)
        for (const double beside : {-1e-3, -1e-12, 1e-12, 1e-3}) {
          Vector3 near = axis;
          near[j] += beside;
          CHECK(coordinate_across(near) == coordinate_across(axis));
        }
    }
  for (double x = -1; x <= 1; x += 0.125)
    for (double y = -1; y <= 1; y += 0.125)
      for (double z = -1; z <= 1; z += 0.125) {
        const Vector3 axis(x, y, z);
        if (axis.isZero()) continue;
        CHECK(axis.cross(Vector3::Unit(coordinate_across(axis))).norm() >= 0.799 * axis.norm());
      }
}
