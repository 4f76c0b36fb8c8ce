#include "costate/kind/joint/joint_axes.h"

#include <fmt/format.h>

#include <numbers>
#include <tuple>

#include "costate/base/error.h"
#include "costate/element/constraint/offset.h"
#include "costate/element/constraint/on_axis.h"
#include "costate/element/constraint/spatial_coincidence.h"
#include "costate/element/constraint/turn_angle.h"
#include "costate/mechanism/taken_number.h"

namespace costate {

namespace {

Vector3 vector3(const std::array<double, 3>& x) { return {x[0], x[1], x[2]}; }
}  // namespace

JointBuilder::JointBuilder(MechanismBuilder& builder, const std::string& kind, const std::string& name,
                           const std::pair<std::string, std::string>& points)
    : builder_(builder), kind_(kind), name_(name), d_(find_spatial_pair(builder, kind + "." + name, "points", points)) {
  if (d_.from().coordinates() == d_.to().coordinates())
    throw ModelError(kind + "." + name + ".points",
                     fmt::format("'{}' and '{}' are fixed to {}; a joint needs points of two bodies, or of a body and "
                                 "the ground.",
                                 points.first, points.second, d_.size() == 0 ? "the ground" : "the same body"));
}

std::vector<int> JointBuilder::add_axis(const std::string& key, const std::array<double, 3>& axis) {
  const std::string at = path() + "." + key;
  if (axis[0] == 0 && axis[1] == 0 && axis[2] == 0) throw ModelError(at, "A direction must not be zero.");
  std::vector<int> r;
  for (std::size_t i = 0; i < 3; ++i) r.push_back(builder_.add_number(fmt::format("{}[{}]", at, i), axis[i]));
  return r;
}

std::vector<int> JointBuilder::add_taken_axis(const std::string& key, const std::array<double, 3>& axis,
                                              const std::vector<int>& coordinates, const std::vector<int>& numbers) {
  const std::string at = path() + "." + key;
  const std::string written_as = fmt::format("{} = [{}, {}, {}]", at, axis[0], axis[1], axis[2]);
  std::vector<int> r;
  for (std::size_t i = 0; i < 3; ++i) {
    r.push_back(add_taken_number(builder_, fmt::format("{}[{}]", at, i), axis[i], coordinates, numbers, NumberRule::any,
                                 written_as));
    builder_.fix_number(r.back(), fmt::format("the scene leaves it out; write {} to vary it.", written_as));
  }
  return r;
}

std::vector<int> JointBuilder::both_orientations() const {
  std::vector<int> r = direction(0).coordinates();
  const std::vector<int> second = direction(1).coordinates();
  r.insert(r.end(), second.begin(), second.end());
  return r;
}

BodyDirection JointBuilder::direction(int i) const {
  try {
    return BodyDirection(point(i).direction_coordinates());
  } catch (const ModelError& e) {
    throw ModelError(fmt::format("{}.points[{}]", path(), i), e.bare_message());
  }
}

Vector3 JointBuilder::first_direction(int i, const Vector3& components) const {
  const BodyDirection u = direction(i);
  double q[BodyDirection::kMax] = {};
  for (int k = 0; k < u.size(); ++k) q[k] = builder_.first_value(u.coordinates()[static_cast<std::size_t>(k)]);
  return u.value(q, components);
}

void JointBuilder::set_axes(const JointAxes& axes, const std::string& key) {
  for (const int i : {0, 1}) direction(i);  // both ends have directions
  axes_ = axes;
  first_axis_ = vector3(axes.first);
  axis_numbers_ = add_axis(key + "_first", axes.first);
  const auto second = axes.second_is == JointAxes::Second::given ? add_axis(key + "_second", axes.second)
                      : axes.second_is == JointAxes::Second::like_first
                          ? axis_numbers_
                          : add_taken_axis(key + "_second", axes.second, both_orientations(), {});
  axis_numbers_.insert(axis_numbers_.end(), second.begin(), second.end());
}

void JointBuilder::set_normals() {
  if (!normal_numbers_.empty()) return;
  if (axes_.normal_first.has_value() != axes_.normal_second.has_value())
    throw ModelError(path(), "Give both 'normal_first' and 'normal_second', or neither.");
  if (!axes_.normal_first && axes_.first != axes_.second)
    throw ModelError(path(),
                     "The axes differ, so that the frames of the two bodies are not parallel: give "
                     "'normal_first' and 'normal_second', directions across the axes that stay parallel, or are "
                     "so where the angle is zero.");
  const bool chosen = !axes_.normal_first;
  if (chosen) {
    std::array<double, 3> b, c;
    perpendicular_pair(axes_.first.data(), coordinate_across(first_axis_), b.data(), c.data());
    axes_.normal_first = axes_.normal_second = b;
  }
  for (const auto& [key, axis, normal] : {std::tuple("normal_first", axes_.first, *axes_.normal_first),
                                          std::tuple("normal_second", axes_.second, *axes_.normal_second)}) {
    const Vector3 a = vector3(axis), n = vector3(normal);
    if (!(cross(a, n).norm() > 0.1 * a.norm() * n.norm()))
      throw ModelError(path() + "." + key, "A normal must lie across its axis, not along it.");
    const bool posed = axes_.second_is == JointAxes::Second::as_first_posed && !normal_numbers_.empty();
    const auto numbers = chosen  ? add_taken_axis(key, normal, {}, first_axis_numbers())
                         : posed ? add_taken_axis(key, normal, both_orientations(), {})
                                 : add_axis(key, normal);
    if (axes_.second_is == JointAxes::Second::as_first_posed && !posed)
      for (const int k : numbers)
        builder_.fix_number(k,
                            "the joint keeps the bodies as they first stand; write axis_first, ... to vary its axes.");
    normal_numbers_.insert(normal_numbers_.end(), numbers.begin(), numbers.end());
  }
}

std::vector<int> JointBuilder::axis_and_normal_numbers() {
  set_normals();
  std::vector<int> numbers = axis_numbers_;
  numbers.insert(numbers.end(), normal_numbers_.begin(), normal_numbers_.end());
  return numbers;
}

JointAxes JointBuilder::axes_of_first_poses() const {
  // Base vectors of the first body, in the second one's frame; the first poses need not be exactly
  // normalised.
  const auto in_second = [&](const Vector3& s) -> std::array<double, 3> {
    const Vector3 u = first_direction(0, s).normalized();
    std::array<double, 3> r;
    for (int k = 0; k < 3; ++k)
      r[static_cast<std::size_t>(k)] = first_direction(1, Vector3::Unit(k)).normalized().dot(u);
    return r;
  };
  JointAxes axes{{1, 0, 0}, in_second(Vector3::UnitX())};
  axes.normal_first = {0, 1, 0};
  axes.normal_second = in_second(Vector3::UnitY());
  axes.second_is = JointAxes::Second::as_first_posed;
  return axes;
}

void JointBuilder::keep_together() { builder_.add(std::make_unique<SpatialCoincidenceConstraint>(kind_, name_, d_)); }

void JointBuilder::keep_on_axis() {
  builder_.add(std::make_unique<OnAxisConstraint>(kind_, name_, d_, first_axis_numbers(), first_axis_));
}

void JointBuilder::keep_in_plane() {
  builder_.add(std::make_unique<OffsetConstraint>(kind_, name_, d_, first_axis_numbers(), std::nullopt));
}

void JointBuilder::keep_directions(DirectionsConstraint::Condition condition) {
  const auto numbers =
      condition == DirectionsConstraint::Condition::aligned ? axis_and_normal_numbers() : axis_numbers_;
  builder_.add(std::make_unique<DirectionsConstraint>(kind_, name_, condition, direction(0), direction(1), numbers,
                                                      first_axis_));
}

void JointBuilder::add_angle(const JointCoordinate& c) {
  const auto numbers = axis_and_normal_numbers();
  Vector3 w, turned, u, unused;
  across_axis(first_axis_.data(), axes_.normal_first->data(), w.data(), turned.data());
  across_axis(axes_.second.data(), axes_.normal_second->data(), u.data(), unused.data());
  const Vector3 U = first_direction(1, u);
  const double found = std::atan2(U.dot(first_direction(0, turned)), U.dot(first_direction(0, w)));
  // The constraint also holds half a turn away: the first poses must tell which is meant.
  if (std::abs(std::remainder(c.position.value_or(found) - found, 2 * std::numbers::pi)) > std::numbers::pi / 2)
    throw ModelError(path() + ".angle_rad",
                     fmt::format("The angle {:.6g} rad is more than a quarter of a turn from the first poses of the "
                                 "bodies, which stand at {:.6g} rad. Give them poses (first guesses) nearer to it.",
                                 *c.position, found));
  const std::string key = path() + ".angle_rad";
  const int position = c.position ? builder_.add_number(key, *c.position)
                                  : add_taken_number(builder_, key, found, both_orientations(), numbers);
  const int velocity = builder_.add_number(path() + ".angular_velocity_rad_per_s", c.velocity);
  const int angle = builder_.add_coordinate(c.name + ".angle", "rad", position, velocity);
  builder_.add_angle(c.name, angle);
  builder_.add(std::make_unique<TurnAngleConstraint>(kind_, name_, direction(0), direction(1), angle, numbers));
}

void JointBuilder::add_displacement(const JointCoordinate& c) {
  const Vector3 d = builder_.first_position(d_.to()) - builder_.first_position(d_.from());
  const double found = first_direction(0, first_axis_.normalized()).dot(d);
  const std::string key = path() + ".displacement_m";
  std::vector<int> coordinates = direction(0).coordinates(), numbers = first_axis_numbers();
  for (const auto& p : {d_.from(), d_.to()}) {
    coordinates.insert(coordinates.end(), p.coordinates().begin(), p.coordinates().end());
    numbers.insert(numbers.end(), p.numbers().begin(), p.numbers().end());
  }
  const int position =
      c.position ? builder_.add_number(key, *c.position) : add_taken_number(builder_, key, found, coordinates, numbers);
  const int velocity = builder_.add_number(path() + ".velocity_m_per_s", c.velocity);
  const int way = builder_.add_coordinate(c.name + ".displacement", "m", position, velocity);
  builder_.add(std::make_unique<OffsetConstraint>(kind_, name_, d_, first_axis_numbers(), way));
}

void add_joint(MechanismBuilder& builder, const JointRecipe& recipe, const std::string& name,
               const std::pair<std::string, std::string>& points, const JointAxes& axes,
               const JointCoordinates& coordinates) {
  JointBuilder joint(builder, recipe.kind, name, points);
  joint.set_axes(axes, recipe.axis_key);
  switch (recipe.place) {
    case JointRecipe::Place::together:
      joint.keep_together();
      break;
    case JointRecipe::Place::on_axis:
      joint.keep_on_axis();
      break;
    case JointRecipe::Place::in_plane:
      joint.keep_in_plane();
      break;
  }
  joint.keep_directions(recipe.directions);
  if (coordinates.angle) joint.add_angle(*coordinates.angle);
  if (coordinates.displacement) joint.add_displacement(*coordinates.displacement);
}

std::array<double, 3> read_direction(SceneTable& table, const std::string& key) {
  const auto x = table.values(key);
  if (x.size() != 3) table.fail(key, fmt::format("must hold x, y, z, found {} numbers.", x.size()));
  if (x[0] == 0 && x[1] == 0 && x[2] == 0) table.fail(key, "must not be zero.");
  return {x[0], x[1], x[2]};
}

/// The name of what has the coordinate: "lift" of "lift.angle", as it is called elsewhere.
static std::string owner(const std::string& name, const std::string& coordinate) {
  return name.ends_with(coordinate) ? name.substr(0, name.size() - coordinate.size()) : name;
}

void read_joint(const JointRecipe& recipe, const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  const auto points = table.text_pair("points");
  const std::string first = recipe.axis_key + "_first", second = recipe.axis_key + "_second";
  JointAxes axes;
  axes.first = read_direction(table, first);
  // The axes of a universal joint differ by nature.
  const bool same = recipe.directions != DirectionsConstraint::Condition::perpendicular && !table.has(second);
  axes.second = same ? axes.first : read_direction(table, second);
  if (same) axes.second_is = JointAxes::Second::like_first;
  JointCoordinates coordinates;
  if (recipe.angle && table.has("angle"))
    coordinates.angle = {owner(table.text("angle"), ".angle"), table.find_value("angle_rad"),
                         table.value("angular_velocity_rad_per_s", NumberRule::any, 0)};
  if (recipe.displacement && table.has("displacement"))
    coordinates.displacement = {owner(table.text("displacement"), ".displacement"), table.find_value("displacement_m"),
                                table.value("velocity_m_per_s", NumberRule::any, 0)};
  if (recipe.directions == DirectionsConstraint::Condition::aligned || coordinates.angle) {
    if (table.has("normal_first")) axes.normal_first = read_direction(table, "normal_first");
    if (table.has("normal_second")) axes.normal_second = read_direction(table, "normal_second");
  }
  add_joint(builder, recipe, name, points, axes, coordinates);
}

ScenePhase joint_phase(const SceneTable& table) {
  return table.has("angle") || table.has("displacement") ? ScenePhase::angles : ScenePhase::elements;
}

}  // namespace costate
