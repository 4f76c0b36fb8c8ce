#include "costate/kind/contact/contact.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <type_traits>

#include "costate/base/error.h"
#include "costate/element/force/contact.h"
#include "costate/element/force/contact_road.h"
#include "costate/kind/contact/rigid_contact.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

bool turns(const ContactOptions& o) { return o.rolling_resistance_m > 0 || o.spinning_resistance_m > 0; }

std::vector<int> add_numbers(MechanismBuilder& builder, const std::string& path, const ContactOptions& o,
                             std::size_t points, bool space) {
  constexpr auto positive = NumberRule::positive, not_negative = NumberRule::non_negative;
  ContactNumbers numbers(builder, path);
  numbers.add_normal_law(o);
  numbers.add_friction(o);
  numbers.add("ground_height_m", o.ground_height_m, NumberRule::any, true);
  numbers.add("ground_angle_rad", o.ground_angle_rad, NumberRule::any, true);
  numbers.add("radius_m", o.radius_m, not_negative, o.radius_m > 0);
  numbers.add("ground_x_m", o.ground_x_m, NumberRule::any, true);
  numbers.add_start(o,
                    touch_is_event(normal_law(path + ".law", o.law), friction_model(path + ".friction", o.friction)) ||
                        !o.ahead_of.empty());
  numbers.add("rolling_resistance_m", o.rolling_resistance_m, not_negative, turns(o));
  numbers.add("spinning_resistance_m", o.spinning_resistance_m, not_negative, turns(o) && space);
  numbers.add("turning_transition_rad_per_s", o.turning_transition_rad_per_s, positive, turns(o));
  numbers.add_materials(o, "ground_");
  if (points > 1)
    for (std::size_t i = 0; i < points; ++i)
      numbers.add(fmt::format("shares[{}]", i), o.shares.empty() ? 1 : o.shares[i], not_negative, true);
  return numbers.all();
}

void check_sizes(const std::string& path, const ContactOptions& o, const std::vector<std::string>& points, bool space) {
  if (points.empty()) throw ModelError(path + ".points", "A contact needs a point.");
  if (!o.shares.empty() && o.shares.size() != points.size())
    throw ModelError(path + ".shares",
                     fmt::format("One share a point is expected: {}, found {}.", points.size(), o.shares.size()));
  if (!o.shares.empty() && points.size() == 1)
    throw ModelError(path + ".shares", "A single point takes all: leave this out.");
  check_materials(path, o, "ground_", o.radius_m > 0);
  if (o.radius_m <= 0 && turns(o))
    throw ModelError(path + (o.rolling_resistance_m > 0 ? ".rolling_resistance_m" : ".spinning_resistance_m"),
                     "Only what has a radius rolls: give 'radius_m', or leave this out.");
  if (o.spinning_resistance_m > 0 && !space)
    throw ModelError(path + ".spinning_resistance_m", "Nothing of the plane spins about its normal: leave this out.");
}

template <class Point>
void add_at(MechanismBuilder& builder, const std::string& name, const std::vector<Point>& points,
            const std::optional<Point>& ahead_of, const ContactOptions& o) {
  const std::string path = "contact." + name;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    const std::string key = points.size() == 1 ? ".point" : fmt::format(".points[{}]", i);
    if (point.kind() == Point::Kind::ground)
      throw ModelError(path + key, "'" + point.name() + "' is on the ground itself.");
    if (points.size() > 1 &&
        (point.kind() != Point::Kind::on_body || point.coordinates() != points.front().coordinates()))
      throw ModelError(path + key,
                       fmt::format("The points of one contact are on one rigid body; '{}' is not on that of "
                                   "'{}'. Write a contact for each.",
                                   point.name(), points.front().name()));
    if (o.radius_m > 0 && point.kind() != Point::Kind::on_body)
      throw ModelError(path + ".radius_m",
                       "'" + point.name() +
                           "' is on no rigid body, whose turning the radius needs: an arc or a sphere "
                           "belongs to one.");
    if (ahead_of && !ahead_of->coordinates().empty() && ahead_of->coordinates() == point.coordinates())
      throw ModelError(path + ".ahead_of", fmt::format("'{}' is on the body of '{}' itself: name a point of another "
                                                       "one, or of the ground.",
                                                       ahead_of->name(), point.name()));
  }
  ContactSetup options;
  options.law = normal_law(path + ".law", o.law);
  options.friction = friction_model(path + ".friction", o.friction);
  options.round = o.radius_m > 0;
  options.rolling = turns(o);
  options.energy = o.energy_lost;
  options.material = o.youngs_modulus_Pa <= 0         ? ContactMaterial::none
                     : o.other_youngs_modulus_Pa <= 0 ? ContactMaterial::body
                                                      : ContactMaterial::both;
  constexpr bool space = ContactSurface<Point>::dim == 3;
  const std::vector<int> numbers = add_numbers(builder, path, o, points.size(), space);
  const auto add = [&](auto contact) {
    if (contact->states() > kMaxLocal)
      throw ModelError(path + ".points", fmt::format("Contacts of {} points with this law and friction have {} states, "
                                                     "more than {}: write them as several contacts.",
                                                     points.size(), contact->states(), kMaxLocal));
    builder.add(std::move(contact));
  };
  const Point* ahead = ahead_of ? &*ahead_of : nullptr;
  if (!o.ground.any()) return add(std::make_unique<Contact<Point>>(name, points, ahead, options, numbers));
  const ContactGround ground =
      find_contact_ground(builder, path, o.ground, points.front().coordinates(), options.round, space);
  if (ahead && !ground.carrier.empty())
    throw ModelError(path + ".ahead_of",
                     "On ground that a body carries a contact closes everywhere: leave this out, or "
                     "'ground_body'.");
  add(std::make_unique<RoadContact<Point>>(name, points, ahead, options, numbers, ground));
}

}  // namespace

void add_contact(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& points,
                 const ContactOptions& o) {
  const std::string path = "contact." + name;
  const bool space = !points.empty() && builder.has_spatial_point(points.front());
  check_sizes(path, o, points, space);
  tell_of_wall(path, o.ground_x_m, o.ground_height_m, o.ground_angle_rad);
  const auto key = [&](std::size_t i) {
    return path + (points.size() == 1 ? ".point" : fmt::format(".points[{}]", i));
  };
  const auto add = [&](auto find) {
    using Point = std::decay_t<decltype(find(std::string(), std::string()))>;
    std::vector<Point> of;
    for (std::size_t i = 0; i < points.size(); ++i) of.push_back(find(key(i), points[i]));
    std::optional<Point> ahead;
    if (!o.ahead_of.empty()) ahead = find(path + ".ahead_of", o.ahead_of);
    add_at<Point>(builder, name, of, ahead, o);
  };
  if (space)
    add([&](const std::string& subject, const std::string& point) {
      if (!builder.has_spatial_point(point))
        throw ModelError(subject, fmt::format("There is no point '{}' of space.", point));
      return builder.spatial_point(point);
    });
  else
    add([&](const std::string& subject, const std::string& point) { return find_point(builder, subject, point); });
}

namespace {

/// A scene that is made for compliant contact is read as one of rigid contact: what only the former has plays no part.
void add_rigid(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  const std::string path = "contact." + name;
  for (const char* key : {"points", "shares"})
    if (table.has(key)) throw ModelError(path + "." + key, "A rigid contact has one point: write a contact for each.");
  for (const char* key : {"road", "ground_body"})
    if (table.has(key))
      throw ModelError(path + "." + key,
                       "Rigid contact is with a plane at rest: leave this out, or take kind = "
                       "\"compliant\".");
  for (const char* key : {"rolling_resistance_m", "spinning_resistance_m"})
    if (table.has(key) && table.value(key, NumberRule::non_negative) > 0)
      throw ModelError(path + "." + key,
                       "Rigid contact has no moments against turning: leave this out, set it to 0, or take kind = "
                       "\"compliant\".");
  if (table.has("turning_transition_rad_per_s")) table.value("turning_transition_rad_per_s", NumberRule::positive);
  RigidContactOptions o;
  const std::string point = table.text("point");
  ContactLawOptions compliant;
  if (table.has("stiffness_N_per_m_n") || table.has("youngs_modulus_Pa")) read_normal_law(table, "ground_", compliant);
  o.restitution = table.value("restitution", NumberRule::non_negative, 0);
  // Without restitution both laws are one.
  const std::string law = table.one_of("restitution_law", {"newton", "poisson"}, o.restitution_law);
  if (o.restitution > 0) o.restitution_law = law;
  // A compliant contact that is closed at the start says so by its approach speed.
  const bool pressed =
      table.has("approach_speed_m_per_s") && table.value("approach_speed_m_per_s", NumberRule::non_negative) > 0;
  o.closed = table.flag("closed", pressed);
  o.for_good = table.has("closing_speed_m_per_s");  // where it is 0
  o.closing_speed_m_per_s = table.value("closing_speed_m_per_s", NumberRule::non_negative, 0);
  read_friction(table, compliant);
  if (compliant.friction != "none") o.friction_coefficient = compliant.friction_coefficient;
  // Of models of a compliant contact that have none, too.
  if (compliant.friction != "none" && compliant.static_coefficient < 0)
    compliant.static_coefficient = table.find_value("static_coefficient", NumberRule::non_negative).value_or(-1);
  o.static_coefficient = compliant.static_coefficient;
  const bool rough = o.friction_coefficient > 0 || o.static_coefficient > 0;
  if (o.closed && rough) {
    const std::string sliding = table.one_of("sliding", {"none", "forward", "backward"}, "none");
    o.sliding = sliding == "forward" ? 1 : sliding == "backward" ? -1 : 0;
  }
  // Of one that is open at the start it says nothing, but feet that swap roles have it both.
  if (rough && o.sliding == 0) {
    if (table.has("along_m")) o.along_m = table.value("along_m", NumberRule::any);
    if (table.has("across_m")) o.across_m = table.value("across_m", NumberRule::any);
    if (o.across_m && !builder.has_spatial_point(point))
      throw ModelError(path + ".across_m", "The plane has one direction along the ground, along_m: leave this out.");
  }
  o.ground_x_m = table.value("ground_x_m", NumberRule::any, 0);
  o.ground_height_m = table.value("ground_height_m", NumberRule::any, 0);
  o.ground_angle_rad = table.value("ground_angle_rad", NumberRule::any, 0);
  o.radius_m = table.value("radius_m", NumberRule::non_negative, 0);
  o.ahead_of = table.text("ahead_of", "");
  table.flag("energy_lost", false);  // a run's events say what each impact takes
  add_rigid_contact(builder, name, point, o);
  // Parameters of such a scene find their numbers, on which nothing depends then.
  for (const auto& [key, value] : {std::pair{"stiffness_N_per_m_n", compliant.stiffness_N_per_m_n},
                                   {"exponent", compliant.exponent},
                                   {"damping_N_s_per_m", compliant.damping_N_s_per_m},
                                   {"transition_velocity_m_per_s", compliant.transition_velocity_m_per_s}})
    if (value >= 0 && table.has(key)) builder.add_number(path + "." + key, value, NumberRule::non_negative);
}

const RegisterSceneKind contact_registered({
    .name = "contact",
    .phase = ScenePhase::elements,
    .summary = "compliant contact of points, arcs or spheres with the ground, with friction",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[body.ball]
x_m = 0
y_m = 0.098
vx_m_per_s = 0.4
vy_m_per_s = -0.3
angular_velocity_rad_per_s = 2
mass_kg = 1.5
inertia_kg_m2 = 0.006

[point.C]
on = "ball"
x_m = 0
y_m = 0

[contact.floor]
point = "C"
law = "hunt-crossley"
stiffness_N_per_m_n = 2e4
restitution = 0.7
radius_m = 0.1
ground_x_m = 0.01
ground_angle_rad = -0.05
friction = "stribeck"
friction_coefficient = 0.4
static_coefficient = 0.5
transition_velocity_m_per_s = 0.05
approach_speed_m_per_s = 0.31

[start]
given = ["ball.x", "ball.y", "ball.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          constexpr auto positive = NumberRule::positive, not_negative = NumberRule::non_negative;
          if (table.one_of("kind", {"compliant", "rigid"}, "compliant") == "rigid")
            return add_rigid(name, table, builder);
          ContactOptions o;
          std::vector<std::string> points = table.texts("points", false);
          if (points.empty()) points = {table.text("point")};
          read_normal_law(table, "ground_", o);
          o.ahead_of = table.text("ahead_of", "");
          read_friction(table, o);
          if (touch_is_event(normal_law("", o.law), friction_model("", o.friction)) || !o.ahead_of.empty())
            o.approach_speed_m_per_s = table.value("approach_speed_m_per_s", not_negative, o.approach_speed_m_per_s);
          o.ground_x_m = table.value("ground_x_m", NumberRule::any, 0);
          o.ground_height_m = table.value("ground_height_m", NumberRule::any, 0);
          o.ground_angle_rad = table.value("ground_angle_rad", NumberRule::any, 0);
          o.ground.road = table.text("road", "");
          o.ground.ground_body = table.text("ground_body", "");
          o.radius_m = table.value("radius_m", not_negative, 0);
          if (o.radius_m > 0) {
            o.rolling_resistance_m = table.value("rolling_resistance_m", not_negative, 0);
            o.spinning_resistance_m = table.value("spinning_resistance_m", not_negative, 0);
            if (turns(o))
              o.turning_transition_rad_per_s =
                  table.value("turning_transition_rad_per_s", positive, o.turning_transition_rad_per_s);
          }
          if (points.size() > 1 && table.has("shares")) o.shares = table.values("shares", not_negative);
          o.energy_lost = table.flag("energy_lost", false);
          add_contact(builder, name, points, o);
        },
});

}  // namespace

}  // namespace costate
