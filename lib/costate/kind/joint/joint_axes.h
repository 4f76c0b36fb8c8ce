// Axes of joints in space: what the kinds of joints share.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "costate/element/constraint/directions.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

/// Directions of any length but zero, each in the frame of its point's body (the ground's is the global
/// frame).
struct JointAxes {
  std::array<double, 3> first = {}, second = {};
  /// Translational joints: directions across the axes that stay parallel. Without them, the two frames stay
  /// parallel, which needs the same axis in both.
  std::optional<std::array<double, 3>> normal_first = {}, normal_second = {};
  /// What the second body's axis, and its normal, is where the scene leaves it out: the first body's numbers, or taken
  /// from the first poses so that the bodies stand to each other as there.
  enum class Second { given, like_first, as_first_posed } second_is = Second::given;
};

/// A coordinate that a joint adds to the mechanism: the turn about its axis, NAME.angle [rad], or the way
/// along it, NAME.displacement [m], of the second body against the first.
struct JointCoordinate {
  std::string name;
  /// Start values, or first guesses where the start does not give them; by default the position follows from
  /// the first poses of the bodies.
  std::optional<double> position = {};
  double velocity = 0;
};
struct JointCoordinates {
  std::optional<JointCoordinate> angle = {}, displacement = {};
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
  /// The second point stays in the plane across the first axis through the first one.
  void keep_in_plane();
  void keep_directions(DirectionsConstraint::Condition condition);
  void add_angle(const JointCoordinate& angle);
  void add_displacement(const JointCoordinate& displacement);
  /// Registers the axes' numbers, as `key`_first and `key`_second; to be called before what uses them.
  void set_axes(const JointAxes& axes, const std::string& key = "axis");
  /// Both bodies' axes such that the bodies stand to each other as at their first poses.
  JointAxes axes_of_first_poses() const;

 private:
  std::string path() const { return kind_ + "." + name_; }
  std::vector<int> add_axis(const std::string& key, const std::array<double, 3>& axis);
  /// With components that the scene leaves out and that are taken from first values of coordinates and from numbers.
  std::vector<int> add_taken_axis(const std::string& key, const std::array<double, 3>& axis,
                                  const std::vector<int>& coordinates, const std::vector<int>& numbers);
  std::vector<int> both_orientations() const;
  /// The normals, as given or chosen, with their numbers.
  void set_normals();
  std::vector<int> axis_and_normal_numbers();
  const SpatialPoint& point(int i) const { return i == 0 ? d_.from() : d_.to(); }
  BodyDirection direction(int i) const;
  /// The direction with these components in body i, at its first pose.
  Vector3 first_direction(int i, const Vector3& components) const;
  std::vector<int> first_axis_numbers() const { return {axis_numbers_.begin(), axis_numbers_.begin() + 3}; }

  MechanismBuilder& builder_;
  std::string kind_, name_;
  SpatialVector d_;
  std::vector<int> axis_numbers_, normal_numbers_;
  Vector3 first_axis_ = Vector3::Zero();
  JointAxes axes_;
};

/// What a kind of joint keeps, and which coordinates it can have.
struct JointRecipe {
  enum class Place { together, on_axis, in_plane };
  std::string kind;
  Place place;
  DirectionsConstraint::Condition directions;
  bool angle = false, displacement = false;
  std::string axis_key = "axis";
};
void add_joint(MechanismBuilder& builder, const JointRecipe& recipe, const std::string& name,
               const std::pair<std::string, std::string>& points, const JointAxes& axes,
               const JointCoordinates& coordinates = {});
/// Reads points, axes, and the coordinates "angle" and "displacement" as the recipe allows.
void read_joint(const JointRecipe& recipe, const std::string& name, SceneTable& table, MechanismBuilder& builder);
/// A joint with coordinates comes before the elements that use them.
ScenePhase joint_phase(const SceneTable& table);

std::array<double, 3> read_direction(SceneTable& table, const std::string& key);

}  // namespace costate
