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
  ContactNumbers numbers(builder, path);
  numbers.add("restitution", o.restitution, NumberRule::non_negative, true);
  numbers.add("friction_coefficient", 0, NumberRule::non_negative, false);
  numbers.add("closing_speed_m_per_s", 0, NumberRule::non_negative, false);
  numbers.add("ground_height_m", o.ground_height_m, NumberRule::any, true);
  numbers.add("ground_angle_rad", o.ground_angle_rad, NumberRule::any, true);
  numbers.add("radius_m", o.radius_m, NumberRule::non_negative, o.radius_m > 0);
  numbers.add("closed", 0, NumberRule::any, false);
  builder.add(std::make_unique<RigidContact<Point>>(name, point, ahead_of ? &*ahead_of : nullptr, o.radius_m > 0,
                                                    numbers.all()));
}

}  // namespace

void add_rigid_contact(MechanismBuilder& builder, const std::string& name, const std::string& point,
                       const RigidContactOptions& o) {
  const std::string path = "contact." + name;
  if (!(o.restitution >= 0) || o.restitution > 1)
    throw ModelError(
        path + ".restitution",
        fmt::format("The speed after an impact by the speed before is expected, 0 to 1; found {:g}.", o.restitution));
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
