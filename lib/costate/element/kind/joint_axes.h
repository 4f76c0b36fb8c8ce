// Axes of joints in space: what the kinds of joints share.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "costate/element/constraint/directions.h"
#include "costate/element/kind/lookup.h"
#include "costate/scene/scene_table.h"

namespace costate {

/// Directions of any length but zero, each in the frame of its point's body (the ground's is the global
/// frame).
struct JointAxes {
  std::array<double, 3> first = {}, second = {};
  /// Translational joints: directions across the axes that stay parallel. Without them, the two frames stay
  /// parallel, which needs the same axis in both.
  std::optional<std::array<double, 3>> normal_first = {}, normal_second = {};
};

/// A joint between the bodies of two points, both of which it names in errors at path.points[i].
class JointBuilder {
 public:
  JointBuilder(MechanismBuilder& builder, const std::string& kind, const std::string& name,
               const std::pair<std::string, std::string>& points);

  /// The points coincide.
  void keep_together();
  /// The second point stays on the first axis through the first one.
  void keep_on_axis();
  void keep_directions(DirectionsConstraint::Condition condition);
  /// Registers the axes' numbers; to be called before the keep_... that use them.
  void set_axes(const JointAxes& axes);

 private:
  std::vector<int> add_axis(const std::string& key, const std::array<double, 3>& axis);

  MechanismBuilder& builder_;
  std::string kind_, name_;
  SpatialVector d_;
  std::vector<int> axis_numbers_, normal_numbers_;
  Vector3 first_axis_ = Vector3::Zero();
  JointAxes axes_;
};

/// axis_first and axis_second, which is the same if it is missing.
JointAxes read_axes(SceneTable& table);
std::array<double, 3> read_direction(SceneTable& table, const std::string& key);

}  // namespace costate
