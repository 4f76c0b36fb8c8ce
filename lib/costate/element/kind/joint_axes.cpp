#include "costate/element/kind/joint_axes.h"

#include <fmt/format.h>

#include <tuple>

#include "costate/base/error.h"
#include "costate/element/constraint/on_axis.h"
#include "costate/element/constraint/spatial_coincidence.h"

namespace costate {

namespace {
Vector3 vector3(const std::array<double, 3>& x) { return {x[0], x[1], x[2]}; }
}  // namespace

JointBuilder::JointBuilder(MechanismBuilder& builder, const std::string& kind, const std::string& name,
                           const std::pair<std::string, std::string>& points)
    : builder_(builder),
      kind_(kind),
      name_(name),
      d_(find_spatial_pair(builder, kind + "." + name, "points", points)) {
  if (d_.from().coordinates() == d_.to().coordinates())
    throw ModelError(
        kind + "." + name + ".points",
        fmt::format("'{}' and '{}' are fixed to {}; a joint needs points of two bodies, or of a body and "
                    "the ground.",
                    points.first, points.second, d_.size() == 0 ? "the ground" : "the same body"));
}

std::vector<int> JointBuilder::add_axis(const std::string& key, const std::array<double, 3>& axis) {
  const std::string path = kind_ + "." + name_ + "." + key;
  if (axis[0] == 0 && axis[1] == 0 && axis[2] == 0) throw ModelError(path, "A direction must not be zero.");
  std::vector<int> r;
  for (std::size_t i = 0; i < 3; ++i)
    r.push_back(builder_.add_number(fmt::format("{}[{}]", path, i), axis[i]));
  return r;
}

void JointBuilder::set_axes(const JointAxes& axes) {
  axes_ = axes;
  first_axis_ = vector3(axes.first);
  axis_numbers_ = add_axis("axis_first", axes.first);
  const auto second = add_axis("axis_second", axes.second);
  axis_numbers_.insert(axis_numbers_.end(), second.begin(), second.end());
}

void JointBuilder::keep_together() {
  builder_.add(std::make_unique<SpatialCoincidenceConstraint>(kind_, name_, d_));
}

void JointBuilder::keep_on_axis() {
  const std::vector<int> first(axis_numbers_.begin(), axis_numbers_.begin() + 3);
  builder_.add(std::make_unique<OnAxisConstraint>(kind_, name_, d_, first, first_axis_));
}

void JointBuilder::keep_directions(DirectionsConstraint::Condition condition) {
  if (condition == DirectionsConstraint::Condition::aligned && normal_numbers_.empty()) {
    const std::string path = kind_ + "." + name_;
    if (axes_.normal_first.has_value() != axes_.normal_second.has_value())
      throw ModelError(path, "Give both 'normal_first' and 'normal_second', or neither.");
    if (!axes_.normal_first && axes_.first != axes_.second)
      throw ModelError(path,
                       "The axes differ, so that the frames of the two bodies are not parallel: give "
                       "'normal_first' and 'normal_second', directions across the axes that stay parallel.");
    if (!axes_.normal_first) {
      std::array<double, 3> b, c;
      perpendicular_pair(axes_.first.data(), flattest(first_axis_), b.data(), c.data());
      axes_.normal_first = axes_.normal_second = b;
    }
    for (const auto& [key, axis, normal] :
         {std::tuple("normal_first", axes_.first, *axes_.normal_first),
          std::tuple("normal_second", axes_.second, *axes_.normal_second)}) {
      const Vector3 a = vector3(axis), n = vector3(normal);
      if (!(cross(a, n).norm() > 0.1 * a.norm() * n.norm()))
        throw ModelError(path + "." + key, "A normal must lie across its axis, not along it.");
      const auto numbers = add_axis(key, normal);
      normal_numbers_.insert(normal_numbers_.end(), numbers.begin(), numbers.end());
    }
  }
  std::vector<int> numbers = axis_numbers_;
  if (condition == DirectionsConstraint::Condition::aligned)
    numbers.insert(numbers.end(), normal_numbers_.begin(), normal_numbers_.end());
  builder_.add(std::make_unique<DirectionsConstraint>(
      kind_, name_, condition, BodyDirection(d_.from().rotation_coordinates()),
      BodyDirection(d_.to().rotation_coordinates()), numbers, first_axis_));
}

std::array<double, 3> read_direction(SceneTable& table, const std::string& key) {
  const auto x = table.values(key);
  if (x.size() != 3) table.fail(key, fmt::format("must hold x, y, z, found {} numbers.", x.size()));
  if (x[0] == 0 && x[1] == 0 && x[2] == 0) table.fail(key, "must not be zero.");
  return {x[0], x[1], x[2]};
}

JointAxes read_axes(SceneTable& table) {
  JointAxes axes;
  axes.first = read_direction(table, "axis_first");
  axes.second = table.has("axis_second") ? read_direction(table, "axis_second") : axes.first;
  return axes;
}

}  // namespace costate
