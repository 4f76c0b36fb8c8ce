// Triangle meshes of plain solids, of unit size, for scenes in 3-D.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace costate::app {

/// Corners with outward unit normals; three indices a triangle, counter-clockwise from outside.
struct SolidMesh {
  std::vector<Eigen::Vector3f> corners, normals;
  std::vector<std::uint32_t> triangles;

  /// A flat triangle or convex polygon in order.
  void add_face(const std::vector<Eigen::Vector3d>& polygon);
  void add(const SolidMesh& other);
};

/// Radius 1 about the origin.
SolidMesh unit_sphere();
/// From the origin to (0, 1, 0), radius 1.
SolidMesh unit_cylinder();
/// From -1/2 to 1/2 along each axis.
SolidMesh unit_box();
/// A coil of wire from the origin to (0, 1, 0), radius 1.
SolidMesh unit_coil();
/// From the origin to (0, 1, 0): shaft and head, radius 1.
SolidMesh unit_arrow();
/// A tyre about the y axis, radius 1, width 0.5, with spokes that show how far it has turned.
SolidMesh unit_wheel();

/// The convex hull of points; where they lie in a plane or on a line, a plate or a rod of that thickness about it.
SolidMesh convex_solid(std::vector<Eigen::Vector3d> points, double thickness);

}  // namespace costate::app
