// [friction.NAME]: smooth friction with a given normal force, on coordinates, on angles, along the line
// between two points, or along an axis of a body: what a joint leaves free. The law is in
// element/force/friction_law.h.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "costate/mechanism/builder.h"

namespace costate {

struct FrictionOptions {
  double normal_force_N = 0;
  /// Path of the number that is the normal force instead, "spring.clamp.preload_N"; empty: none.
  std::string normal_force_number = {};
  double static_coefficient = 0;
  std::optional<double> dynamic_coefficient = {};  // none: the static one, the same number
  double transition_velocity_m_per_s = 0;
  double viscous_N_s_per_m = 0;
};

/// One coordinate against the ground, or two: the second relative to the first. Both in m, or both in rad,
/// which needs the radius at which surfaces slide [m] (0: none).
void add_coordinate_friction(MechanismBuilder& builder, const std::string& name,
                             const std::vector<std::string>& coordinates, const FrictionOptions& options,
                             double radius_m = 0);
/// The same by the names of angles.
void add_angle_friction(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                        const FrictionOptions& options, double radius_m);
/// On the distance of two points, planar or spatial.
void add_distance_friction(MechanismBuilder& builder, const std::string& name, const std::string& from,
                           const std::string& to, const FrictionOptions& options);
/// On the displacement of `to` from `from` along an axis of from's body (or of the ground).
void add_axis_friction(MechanismBuilder& builder, const std::string& name, const std::string& from,
                       const std::string& to, const std::array<double, 3>& axis, const FrictionOptions& options);
void add_planar_axis_friction(MechanismBuilder& builder, const std::string& name, const std::string& from,
                              const std::string& to, double axis_angle_rad, const FrictionOptions& options);

}  // namespace costate
