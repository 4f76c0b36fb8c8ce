// [rigid_body.NAME]: a rigid body in space with the coordinates NAME.x, .y, .z of its reference point and
// Euler parameters NAME.e0 ... NAME.e3, kept normalised. In [start], NAME alone gives its whole pose and
// motion, NAME.orientation its turn and angular velocity, and NAME.omega_x (body's frame), NAME.omega_global_x, ... are
// velocities that can be given. Outputs besides: NAME.roll, .pitch, .yaw (element/body/cardan_angles.h).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "costate/scene/scene_table.h"

namespace costate {

struct RigidBodyOptions {
  double mass_kg = 0;
  /// About the centre of mass in the body's frame: xx, yy, zz, xy, xz, yz, entries of the tensor (xy is minus
  /// the integral of x y).
  std::array<double, 6> inertia_kg_m2 = {};
  std::array<double, 3> center_m = {};  // centre of mass in the body's frame
  // Start values, or first guesses where the start does not give them.
  std::array<double, 3> position_m = {};
  std::array<double, 4> euler = {1, 0, 0, 0};  // e0, e1, e2, e3, of length 1
  std::array<double, 3> velocity_m_per_s = {};
  std::array<double, 3> omega_rad_per_s = {};
  bool omega_is_global = false;  // components in the global frame, else in the body's
  bool turned_by_axis = false;   // euler was computed, so that e0, ... cannot be parameters
};
void add_rigid_body(MechanismBuilder& builder, const std::string& name, const RigidBodyOptions& options);

/// The keys that the kinds of bodies in space share.
RigidBodyOptions read_rigid_body(SceneTable& table);

/// Mass, inertia, centre and gravity as numbers, in the order in which the bodies of space take them. path:
/// "KIND.NAME.". Throws ModelError for what no body can have.
std::vector<int> add_spatial_body_numbers(MechanismBuilder& builder, const std::string& path,
                                          const RigidBodyOptions& options);

/// Gravity and two bodies of a kind, "stone" and "plate": the beginning of the kind's example.
std::string two_bodies_example(const std::string& kind);

/// Throws ModelError at path + "inertia_xx_kg_m2" for a tensor that no body has: the principal moments of a real body
/// are not negative and none exceeds the sum of the others; 1e-9 of slack for numbers written with few digits.
void check_inertia(const std::string& path, const std::array<double, 6>& inertia_kg_m2);

/// Euler parameters of a turn about an axis of any length but zero.
std::array<double, 4> euler_parameters(const std::array<double, 3>& axis, double angle_rad);

}  // namespace costate
