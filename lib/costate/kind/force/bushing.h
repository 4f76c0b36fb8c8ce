// [bushing.NAME]: three springs and dampers along and three about the axes of a frame, between two bodies of
// space or a body and the ground. It is unloaded, but for its preload, where the points coincide and the
// frames of both bodies have the same orientation. F = k x + c x' + F0 a component.
#pragma once

#include <array>
#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

/// Components x, y, z in the frame on the first body.
struct BushingOptions {
  std::array<double, 3> stiffness_N_per_m = {}, stiffness_N_m_per_rad = {};
  std::array<double, 3> damping_N_s_per_m = {}, damping_N_m_s_per_rad = {};
  std::array<double, 3> preload_N = {}, preload_N_m = {};
  /// Euler parameters of the bushing's frame in each body's frame, of length 1.
  std::array<double, 4> frame_from = {1, 0, 0, 0}, frame_to = {1, 0, 0, 0};
};
void add_bushing(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                 const BushingOptions& options);

}  // namespace costate
