#include "costate/kind/contact/rigid_contact.h"

#include <fmt/format.h>

#include <optional>

#include "costate/base/error.h"
#include "costate/element/force/rigid_contact.h"
#include "costate/kind/contact/contact_numbers.h"
#include "costate/kind/lookup.h"

namespace costate {

namespace {

template <class Point>
void add_at(MechanismBuilder& builder, const std::string& path, const std::string& name, const Point& point,
            const std::optional<Point>& ahead_of, const RigidContactOptions& o) {
  if (point.kind() == Point::Kind::ground)
    throw ModelError(path + ".point", "'" + point.name() + "' is on the ground itself.");
  if (o.radius_m > 0 && point.kind() != Point::Kind::on_body)
    throw ModelError(path + ".radius_m", "'" + point.name() +
                                             "' is on no rigid body, whose turning the radius needs: an arc or a "
                                             "sphere belongs to one.");
  if (ahead_of && !ahead_of->coordinates().empty() && ahead_of->coordinates() == point.coordinates())
    throw ModelError(path + ".ahead_of", fmt::format("'{}' is on the body of '{}' itself: name a point of another "
                                                     "one, or of the ground.",
                                                     ahead_of->name(), point.name()));
  constexpr auto not_negative = NumberRule::non_negative;
  typename RigidContact<Point>::Options options;
  options.round = o.radius_m > 0;
  options.closes = o.restitution == 0 || o.closing_speed_m_per_s > 0 || o.closed || !o.for_good;
  options.sticks = o.friction_coefficient > 0 || o.static_coefficient > 0;
  options.poisson = o.restitution_law == "poisson";
  constexpr bool space = ContactSurface<Point>::dim == 3;
  if (options.sticks && options.round && space && (o.along_m || o.across_m))
    throw ModelError(path + (o.along_m ? ".along_m" : ".across_m"),
                     "A sphere that rolls holds no place: it starts where its body is given. Leave this out.");
  if (space && o.sliding < 0)
    throw ModelError(path + ".sliding",
                     "What slides in space does so along its velocity: \"forward\" says that it slides.");
  ContactNumbers numbers(builder, path);
  numbers.add("restitution", o.restitution, not_negative, o.restitution > 0);
  numbers.add("friction_coefficient", o.friction_coefficient, not_negative, options.sticks);
  if (o.static_coefficient < 0)
    numbers.repeat();
  else
    numbers.add("static_coefficient", o.static_coefficient, not_negative, options.sticks);
  numbers.add("closing_speed_m_per_s", o.closing_speed_m_per_s, not_negative, o.closing_speed_m_per_s > 0);
  numbers.add("ground_height_m", o.ground_height_m, NumberRule::any, true);
  numbers.add("ground_angle_rad", o.ground_angle_rad, NumberRule::any, true);
  numbers.add("radius_m", o.radius_m, not_negative, options.round);
  numbers.add("ground_x_m", o.ground_x_m, NumberRule::any, true);
  numbers.add("closed", o.closed ? 1 : 0, NumberRule::any, false);
  numbers.add("sliding", o.closed && options.sticks ? o.sliding : 0, NumberRule::any, false);
  if (space) numbers.add("sliding_offset_m_per_s", 0, NumberRule::any, false);
  auto contact =
      std::make_unique<RigidContact<Point>>(name, point, ahead_of ? &*ahead_of : nullptr, options, numbers.all());
  if (options.closes) {
    using Contact = RigidContact<Point>;
    std::vector<int> own(numbers.all().begin() + Contact::kGround, numbers.all().begin() + Contact::kClosed);
    const bool placed = o.along_m || o.across_m;
    if (placed) own.push_back(builder.add_number(path + ".along_m", o.along_m.value_or(0), NumberRule::any));
    if (placed && space) own.push_back(builder.add_number(path + ".across_m", o.across_m.value_or(0), NumberRule::any));
    const int friction = numbers.all()[static_cast<std::size_t>(Contact::kFriction)];
    auto rows = std::make_unique<ContactRows<Point>>(name, point, options.round, options.sticks, placed, friction,
                                                     *contact, contact->closed_state(), contact->sliding_state(), own);
    contact->hold_by(*rows);
    builder.add(std::move(rows));
  }
  builder.add(std::move(contact));
}

}  // namespace

void add_rigid_contact(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const RigidContactOptions& o) {
  const std::string path = "contact." + name;
  if (!(o.restitution >= 0) || o.restitution > 1)
    throw ModelError(
        path + ".restitution",
        fmt::format("The speed after an impact by the speed before is expected, 0 to 1; found {:g}.", o.restitution));
  tell_of_wall(path, o.ground_x_m, o.ground_height_m, o.ground_angle_rad);
  if (o.static_coefficient >= 0) check_sticking(path, o.friction_coefficient, o.static_coefficient);
  const auto add = [&](const auto& find) {
    const auto at = find(path + ".point", point);
    std::optional<std::decay_t<decltype(at)>> ahead;
    if (!o.ahead_of.empty()) ahead = find(path + ".ahead_of", o.ahead_of);
    add_at(builder, path, name, at, ahead, o);
  };
  if (builder.has_spatial_point(point))
    add([&](const std::string& subject, const std::string& p) {
      if (!builder.has_spatial_point(p)) throw ModelError(subject, fmt::format("There is no point '{}' of space.", p));
      return builder.spatial_point(p);
    });
  else
    add([&](const std::string& subject, const std::string& p) { return find_point(builder, subject, p); });
}

}  // namespace costate
