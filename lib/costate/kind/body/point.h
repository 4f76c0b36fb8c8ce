// [point.NAME]: points on the ground, free points in natural coordinates, and points fixed to a body or a
// bar; with z_m, points of space: on the ground, free, or fixed to a body in space.
#pragma once

#include <array>
#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

void add_ground_point(MechanismBuilder& builder, const std::string& name, double x_m, double y_m);

/// Start values, or first guesses where the start does not give them. Coordinates: NAME.x, NAME.y.
struct FreePointOptions {
  double x_m = 0, y_m = 0;
  double vx_m_per_s = 0, vy_m_per_s = 0;
};
void add_free_point(MechanismBuilder& builder, const std::string& name, const FreePointOptions& options);

/// `on`: a body (x, y in its frame) or a bar (x along it from its first end, y across).
void add_attached_point(MechanismBuilder& builder, const std::string& name, const std::string& on, double x_m,
                        double y_m);

/// Points of space: on the ground; free, with coordinates NAME.x, .y, .z; or at a place in the frame of the body `on`,
/// a rigid body or one in natural coordinates.
void add_spatial_ground_point(MechanismBuilder& builder, const std::string& name, const std::array<double, 3>& x_m);
void add_spatial_free_point(MechanismBuilder& builder, const std::string& name, const std::array<double, 3>& x_m,
                            const std::array<double, 3>& v_m_per_s = {});
void add_spatial_point(MechanismBuilder& builder, const std::string& name, const std::string& on,
                       const std::array<double, 3>& x_m);

}  // namespace costate
