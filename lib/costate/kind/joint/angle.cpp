#include "costate/kind/joint/angle.h"

#include "costate/base/error.h"
#include "costate/element/constraint/bar_angle.h"
#include "costate/kind/lookup.h"
#include "costate/mechanism/taken_number.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
void add_line_angle(MechanismBuilder& builder, const std::string& name, const PlanarVector& line,
                    const AngleOptions& o) {
  const std::string path = "angle." + name;
  const Eigen::Vector2d d = builder.first_position(line.to()) - builder.first_position(line.from());
  const std::string key = path + ".angle_rad";
  const int start = o.angle_rad ? builder.add_number(key, *o.angle_rad)
                                : add_number_of_line(builder, key, std::atan2(d[1], d[0]), line.from(), line.to());
  const int velocity = builder.add_number(path + ".angular_velocity_rad_per_s", o.angular_velocity_rad_per_s);
  const int angle = builder.add_coordinate(name + ".angle", "rad", start, velocity);
  builder.add_angle(name, angle);
  builder.add(std::make_unique<BarAngleConstraint>(name, line, angle));
}
}  // namespace

void add_angle(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
               const AngleOptions& o) {
  add_line_angle(builder, name, find_line(builder, "angle." + name, from, to), o);
}

void add_bar_angle(MechanismBuilder& builder, const std::string& name, const std::string& bar, const AngleOptions& o) {
  const std::string subject = "angle." + name + ".bar";
  const AttachmentFrame& frame = find_frame(builder, subject, bar);
  if (frame.ends.empty())
    throw ModelError(subject, "'" + bar + "' is a body, which has an angle coordinate '" + bar + ".angle' already.");
  add_line_angle(builder, name, PlanarVector(frame.ends[0], frame.ends[1]), o);
}

namespace {

void add_angle(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  AngleOptions o;
  o.angle_rad = table.find_value("angle_rad");
  o.angular_velocity_rad_per_s = table.value("angular_velocity_rad_per_s", NumberRule::any, 0);
  if (table.has("bar")) return add_bar_angle(builder, name, table.text("bar"), o);
  const std::string from = table.text("from"), to = table.text("to");
  add_angle(builder, name, from, to, o);
}

const RegisterSceneKind angle_registered({
    .name = "angle",
    .phase = ScenePhase::angles,
    .summary = "an angle coordinate of a bar or of the line between two points",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[bar.arm]
from = "A"
to = "P"
mass_kg = 2

[angle.crank]
bar = "arm"
angular_velocity_rad_per_s = 1.5

[body.disc]
x_m = 1.5
y_m = 0.2
angle_rad = 0.3
mass_kg = 1
inertia_kg_m2 = 0.1

[point.rim]
on = "disc"
x_m = 0.2
y_m = 0.1

[angle.sight]
from = "P"
to = "rim"

[start]
given = ["crank.angle", "disc.x", "disc.y", "disc.angle"]
)",
    .add = add_angle,
});

}  // namespace

}  // namespace costate
